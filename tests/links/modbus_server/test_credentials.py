from __future__ import annotations

from gatewayd.links.modbus_server.credentials import PeerCredentials


def test_the_role_in_words() -> None:
    assert PeerCredentials("operator", "plc-1", 1, b"", 0.0).text == "role operator"
    assert PeerCredentials(None, "plc-1", 1, b"", 0.0).text == "no role"

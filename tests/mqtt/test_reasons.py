"""Words of reason codes, compared with paho's."""

from __future__ import annotations

import pytest

from gatewayd.mqtt.reasons import connect_reason, reason

codes = pytest.importorskip("paho.mqtt.reasoncodes")
packets = pytest.importorskip("paho.mqtt.packettypes")


def test_they_are_those_of_paho() -> None:
    for kind in ("CONNACK", "SUBACK", "DISCONNECT"):
        number = getattr(packets.PacketTypes, kind)
        for code in range(0x80, 0x100):
            try:
                known = str(codes.ReasonCode(number, identifier=code))
            except (KeyError, ValueError):
                continue
            assert _plain(reason(code)) == _plain(known)


def _plain(words: str) -> str:
    """paho has the plural in one of them."""
    return words.lower().replace("subscriptions", "subscription")


def test_others_are_numbers() -> None:
    assert (reason(0xFF), connect_reason(9)) == ("code 255", "code 9")
    assert connect_reason(5) == "not authorized"

"""1200h: the COB-IDs of the SDO server."""

from __future__ import annotations

import pytest

from gatewayd.canopen.dictionary import Abort, AbortCode, Dictionary
from gatewayd.canopen.sdo.parameters import server_parameter


def test_cob_ids_follow_the_node_id_and_cannot_be_changed() -> None:
    """CiA 301, 7.5.2.33: the default server is read-only."""
    objects = Dictionary(server_parameter(16))
    assert [objects.read(0x1200, sub) for sub in range(3)] == [
        b"\x02",
        (0x610).to_bytes(4, "little"),
        (0x590).to_bytes(4, "little"),
    ]
    assert all(entry.plus_node for one in objects for entry in one.entries[1:])
    with pytest.raises(Abort) as caught:
        objects.write(0x1200, 1, (0x620).to_bytes(4, "little"))
    assert caught.value.code is AbortCode.READ_ONLY

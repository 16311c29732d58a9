from __future__ import annotations

from gatewayd.links.robot.traffic import RtdeTraffic


def test_both_directions_are_cut_for_themselves() -> None:
    traffic, peer = RtdeTraffic(), "127.0.9.1:30004"
    assert traffic.words(b"\0\3", peer, outgoing=False) == "the beginning of a message, 2 bytes"
    assert traffic.words(bytes((0, 3, 83, 0, 3, 80)), peer, outgoing=True) == "start; pause"
    assert traffic.words(bytes((85,)), peer, outgoing=False).startswith("data")

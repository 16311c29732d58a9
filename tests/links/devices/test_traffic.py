"""Frames of devices in words."""

from __future__ import annotations

from gatewayd.canopen.frame import Frame
from gatewayd.links.can_frames import packed
from gatewayd.links.registry import decoder_of


def test_an_answer_is_known_by_its_request() -> None:
    decoder = decoder_of("device")
    request, answer = bytes.fromhex("000100000006010300640001"), bytes.fromhex("0001000000050103020007")
    assert decoder.words(request, "127.0.0.1:502", outgoing=True) == "unit 1: read holding 100"
    assert decoder.words(answer, "127.0.0.1:502", outgoing=False) == "unit 1: holding 100 = 7"


def test_frames_of_a_serial_line() -> None:
    decoder = decoder_of("device")
    for line in ("/dev/ttyUSB0 19200 8N1", "127.0.0.1:502 RTU"):
        assert decoder.words(bytes.fromhex("09060003fff9abcd"), line, outgoing=True).startswith(
            "unit 9: write"
        )
        assert "refused with 02h" in decoder.words(bytes.fromhex("098602abcd"), line, outgoing=False)


def test_frames_of_a_can_bus() -> None:
    decoder = decoder_of("device")
    data = packed(Frame(0x705, b"\5"))
    assert decoder.words(data, "CAN can1", outgoing=False) == "705h heartbeat of node 5: operational"
    assert decoder.words(b"\1\2", "CAN can1", outgoing=False) == "length 2: 01 02"


def test_whatever_the_bytes_are() -> None:
    decoder = decoder_of("device")
    for length in range(12):
        for outgoing in (True, False):
            assert decoder.words(bytes(length), "/dev/ttyUSB0", outgoing=outgoing)
            assert decoder.words(b"\xff" * length, "127.0.0.1:502", outgoing=outgoing)

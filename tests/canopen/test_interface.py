"""Questions to the kernel and its answers, recorded from a kernel with CAN."""

from __future__ import annotations

import errno
import struct

import pytest

from gatewayd.canopen.interface import ControllerState, InterfaceReader, parse, request


def attribute(kind: int, data: bytes) -> bytes:
    return struct.pack("=HH", len(data) + 4, kind) + data + bytes(-len(data) % 4)


def answer(
    *attributes: bytes, flags: int = 1, hardware: int = 280, index: int = 3, sequence: int = 7
) -> bytes:
    link = struct.pack("=BxHiII", 0, hardware, index, flags, 0) + b"".join(attributes)
    return struct.pack("=IHHII", 16 + len(link), 16, 0, sequence, 0) + link


def controller(state: int, *, restart: int = 0) -> bytes:
    details = [
        attribute(1, struct.pack("=8I", 500_000, 875, 0, 0, 0, 0, 0, 0)),
        attribute(4, struct.pack("=I", state)),
        attribute(6, struct.pack("=I", restart)),
        attribute(8, struct.pack("=HH", 12, 34)),
    ]
    return attribute(18, attribute(1, b"slcan\0") + attribute(0x8002, b"".join(details)))


def test_controller_with_everything_its_driver_reports() -> None:
    found = parse(answer(attribute(33, b"\0"), controller(3, restart=100)), 7)
    assert found is not None
    assert found.is_can
    assert found.up
    assert not found.carrier
    assert found.controller is ControllerState.BUS_OFF
    assert (found.bitrate, found.restart_ms, found.tx_errors, found.rx_errors) == (500_000, 100, 12, 34)


def test_interface_that_is_no_controller_reports_little() -> None:
    found = parse(answer(attribute(33, b"\1"), attribute(18, attribute(1, b"vcan\0")), flags=0), 7)
    assert found is not None
    assert (found.up, found.carrier, found.controller, found.bitrate) == (False, True, None, None)


def test_missing_interface_is_an_answer_and_other_refusals_are_errors() -> None:
    refusal = struct.pack("=IHHIIi", 36, 2, 0, 7, 0, -errno.ENODEV)
    assert parse(refusal, 7) is None
    with pytest.raises(OSError, match="does not describe"):
        parse(struct.pack("=IHHIIi", 36, 2, 0, 7, 0, -errno.EPERM), 7)


def test_answer_to_another_question_is_recognised() -> None:
    with pytest.raises(ValueError, match="question 8"):
        parse(answer(), 8)


def test_question_names_the_interface() -> None:
    asked = request("can0", 5)
    assert len(asked) == struct.unpack_from("=I", asked)[0]
    assert len(asked) % 4 == 0
    assert asked.endswith(b"can0\0\0\0\0")


def test_this_machine_answers() -> None:
    reader = InterfaceReader()
    try:
        loopback = reader.read("lo")
        assert loopback is not None
        assert not loopback.is_can
        assert reader.read("gatewayd-none") is None
        assert reader.read("lo") == loopback
    finally:
        reader.close()

"""What is read from a Modbus device, and what the bytes of an answer say."""

from __future__ import annotations

import pytest

from gatewayd.core.definition import Value
from gatewayd.links.devices.modbus.plan import DevicePlacement
from gatewayd.links.devices.modbus.polls import AnswerReader, polls_of
from gatewayd.modbus.areas import Area
from tests.links.devices.cells import HEAD, device, planned

ONE = HEAD.replace("  gripper: {serial: /dev/ttyUSB0, baudrate: 115200, unit: 9, watchdog: 1s}\n", "")
BIT = "  present: {robot: input_bit_register_0, owner: island, device: %s}\n"
INT = "  level: {robot: input_int_register_0, owner: island, device: %s}\n"
REAL = "  level: {robot: input_double_register_0, owner: island, device: %s}\n"


def inputs(*lines: str) -> list[DevicePlacement]:
    plan = planned("".join(lines), ONE)
    return list(device(plan, "island").inputs(plan.cell))


def said(line: str, data: bytes) -> Value | None:
    placements = inputs(line)
    ((group,),) = (poll.groups for poll in polls_of(placements, 0, single=False))
    ((_, value),) = AnswerReader(placements).values(group, data)
    return value


@pytest.mark.parametrize(
    "line, data, value",
    [
        (BIT % "{discrete: 3}", b"\x01", True),
        (BIT % "{coil: 3}", b"\xfe", False),
        (BIT % "0.10", b"\x04\x00", True),
        (BIT % "0.10", b"\xfb\xff", False),
        (INT % "{input: 1, type: int16}", b"\xff\xfe", -2),
        (INT % "{holding: 1, order: CDAB}", b"\x00\x02\x00\x01", 0x10002),
        (INT % "{holding: 1.high}", b"\x12\x34", 0x12),
        (INT % "{holding: 1.low, type: int8}", b"\x12\xff", -1),
        (INT % "{holding: 1, bits: 4..7}", b"\x12\xa4", 0xA),
        (INT % "{holding: 1, bits: 0..14}", b"\xff\xff", 0x7FFF),
        (REAL % "{input: 1, type: int16, scale: 0.1}", b"\x00\x7d", 12.5),
        (REAL % "{input: 1, bits: 8..15, scale: 0.5, offset: 1}", b"\x04\xff", 3.0),
        (INT % "{input: 1, type: float32}", b"\x7f\xc0\x00\x00", None),
    ],
)
def test_values(line: str, data: bytes, value: Value | None) -> None:
    assert said(line, data) == value


def test_neighbours_come_together_and_gaps_up_to_the_limit() -> None:
    placements = inputs(
        "  a: {robot: input_int_register_0..3, owner: island, device: {input: 10, type: int16}}\n",
        "  b: {robot: input_int_register_4, owner: island, device: {input: 16, type: int16}}\n",
    )
    found = [
        [(group.address, group.size) for group in polls_of(placements, gap, single=False)[0].groups]
        for gap in (0, 2)
    ]
    assert found == [[(10, 4), (16, 1)], [(10, 7)]]


def test_a_device_that_answers_one_value_at_a_time() -> None:
    placements = inputs(
        "  a: {robot: input_int_register_0..2, owner: island, device: {input: 10, type: int16}}\n"
    )
    (poll,) = polls_of(placements, 8, single=True)
    assert [(group.address, group.size) for group in poll.groups] == [(10, 1), (11, 1), (12, 1)]


def test_each_poll_has_its_period() -> None:
    placements = inputs(
        BIT % "{discrete: 3, poll: 1s}", INT % "{input: 1, type: int16}",
    )  # fmt: skip
    found = polls_of(placements, 0, single=False)
    assert [(poll.period, [group.area for group in poll.groups]) for poll in found] == [
        (0.02, [Area.INPUT]),
        (1.0, [Area.DISCRETE]),
    ]


def test_bits_of_one_register_are_read_once() -> None:
    placements = inputs("  a: {robot: input_bit_register_0..15, owner: island, device: 7.0}\n")
    (poll,) = polls_of(placements, 0, single=False)
    (group,) = poll.groups
    values = AnswerReader(placements).values(group, b"\x80\x01")
    assert [value for _, value in values] == [True, *[False] * 14, True]
    assert AnswerReader(placements).variables(group) == [variable for variable, _ in values]

"""What is written to a Modbus device."""

from __future__ import annotations

import pytest

from gatewayd.core.definition import Value
from gatewayd.links.devices.modbus.orders import OrderMaker
from gatewayd.modbus.client.requests import ModbusRequest
from gatewayd.modbus.client.writes import PartWrite
from tests.links.devices.cells import HEAD, device, planned

ONE = HEAD.replace("  gripper: {serial: /dev/ttyUSB0, baudrate: 115200, unit: 9, watchdog: 1s}\n", "")
BIT = "  clamp: {robot: output_bit_register_0, device: %s}\n"
INT = "  speed: {robot: output_int_register_0, device: %s}\n"


def orders(
    lines: str, *values: Value, variable: int = 0, write: str = "auto"
) -> list[str | tuple[int, int, int]]:
    plan = planned(lines, ONE.replace("poll: 20ms", f"write: {write}"))
    island = device(plan, "island")
    found: list[str | tuple[int, int, int]] = []
    for _, order in OrderMaker(island.outputs(plan.cell), island.write).orders(variable, values):
        if isinstance(order, PartWrite):
            found.append((order.address, order.mask, order.value & order.mask))
        else:
            assert isinstance(order, ModbusRequest)
            found.append(order.pdu.hex(" ", 1))
    return found


@pytest.mark.parametrize(
    "line, value, write, pdus",
    [
        (BIT % "{coil: 3}", True, "auto", ["05 00 03 ff 00"]),
        (BIT % "{coil: 3}", True, "multiple", ["0f 00 03 00 01 01 01"]),
        (INT % "{holding: 5, type: int16}", -2, "auto", ["06 00 05 ff fe"]),
        (INT % "{holding: 5, type: int16}", -2, "multiple", ["10 00 05 00 01 02 ff fe"]),
        (INT % "{holding: 5, type: int16}", -2, "read_write", ["17 00 05 00 01 00 05 00 01 02 ff fe"]),
        (INT % "{holding: 5}", 0x10002, "auto", ["10 00 05 00 02 04 00 01 00 02"]),
        (INT % "{holding: 5, order: CDAB}", 0x10002, "auto", ["10 00 05 00 02 04 00 02 00 01"]),
        (INT % "{holding: 5}", 0x10002, "single", ["06 00 05 00 01", "06 00 06 00 02"]),
        (INT % "{holding: 5, type: uint16}", 70000, "auto", ["06 00 05 ff ff"]),
        (BIT % "{holding: 5.3, rest: 0}", True, "auto", ["06 00 05 00 08"]),
    ],
)
def test_whole_values(line: str, value: Value, write: str, pdus: list[str]) -> None:
    assert orders(line, value, write=write) == pdus


@pytest.mark.parametrize(
    "line, value, part",
    [
        (BIT % "{holding: 5.3, rest: keep}", True, (5, 0x0008, 0x0008)),
        (BIT % "{holding: 5.3, rest: keep}", False, (5, 0x0008, 0)),
        (INT % "{holding: 5.high, rest: keep}", 0x12, (5, 0xFF00, 0x1200)),
        (INT % "{holding: 5, bits: 4..7, rest: keep}", 0xA, (5, 0x00F0, 0x00A0)),
        (INT % "{holding: 5, bits: 4..7, rest: keep}", 99, (5, 0x00F0, 0x00F0)),
        (INT % "{holding: 5, bits: 4..7, rest: keep}", -1, (5, 0x00F0, 0)),
    ],
)
def test_a_part_writes_its_own_bits(line: str, value: Value, part: tuple[int, int, int]) -> None:
    assert orders(line, value) == [part]


def test_parts_whose_rest_is_zero_are_written_together() -> None:
    lines = "".join(
        f"  p{n}: {{robot: output_int_register_{n}, device: {{holding: 5, bits: {bits}, rest: 0}}}}\n"
        for n, bits in enumerate(("0..3", "8..15"))
    )
    assert orders(lines, 0xF, 0x12) == orders(lines, 0xF, 0x12, variable=1) == ["06 00 05 12 0f"]


def test_the_key_of_an_order_leads_to_its_variable() -> None:
    plan = planned(INT % "{holding: 5}", ONE)
    maker = OrderMaker(device(plan, "island").outputs(plan.cell), "single")
    assert [maker.variable_of(key) for key, _ in maker.orders(0, [7])] == [0, 0]
    assert maker.variable_of("other") is None

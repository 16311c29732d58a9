"""Values and addresses of mapping files as a client meets them: from the text to the answer."""

from __future__ import annotations

import struct
from pathlib import Path

from gatewayd.core.cell import Cell
from gatewayd.core.definition import Direction
from gatewayd.core.requester import Requester
from gatewayd.links.modbus_server.functions import Unit, execute
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.mapping.loader import load

ROOT = Path(__file__).parents[3]
PLC = Requester(0)
NOW = 1.0

HEAD = """\
gatewayd: 1
cell: press-3
robot: {host: 127.0.0.10}
writers:
  plc: {modbus: 127.0.0.2, timeout: 1s}
"""
SECTION = "modbus: {listen: '127.0.0.1:1502'}\n"


class Plant:
    """A mapping with its robot connected, and a PLC that asks."""

    def __init__(self, text: str, writer: str = "plc") -> None:
        loaded = load(text.encode(), "cell.yaml")
        assert loaded.plan is not None, [finding.message for finding in loaded.diagnostics]
        self.cell = Cell(loaded.plan.cell)
        inputs = self.cell.image.inputs
        self.cell.robot_connected(0.0)
        self.cell.adopt({index: self.cell.image.values[index] for index in inputs}, 0.0)
        self.unit = Unit(loaded.plan.the(ModbusPlan), self.cell)
        names = [one.name for one in loaded.plan.cell.writers]
        self._requester = Requester(names.index(writer))

    def ask(self, pdu: bytes) -> bytes:
        return execute(self.unit, self._requester, pdu, NOW)

    def write(self, address: int, *words: int) -> int:
        """Function 16: 16, or the exception code."""
        head = struct.pack(">BHHB", 16, address, len(words), 2 * len(words))
        answer = self.ask(head + struct.pack(f">{len(words)}H", *words))
        return answer[1] if answer[0] & 0x80 else answer[0]

    def read(self, address: int, count: int = 1) -> tuple[int, ...]:
        """Function 3: the words."""
        answer = self.ask(struct.pack(">BHH", 3, address, count))
        assert answer[0] == 3, answer.hex()
        return struct.unpack(f">{count}H", answer[2:])

    def value(self, name: str) -> object:
        found = [variable.name for variable in self.cell.definition.variables]
        return self.cell.image.values[found.index(name)]


def real(value: float) -> tuple[int, int]:
    """The two registers of an IEC 61131-3 REAL."""
    high, low = struct.unpack(">HH", struct.pack(">f", value))
    return high, low


def test_a_set_point_on_its_maximum_reaches_the_robot_as_the_limit() -> None:
    """The shipped `offset` takes a REAL of 0.05, and the robot gets 0.05: not 03, and not 0.05000000074."""
    plant = Plant((ROOT / "mappings" / "two-plcs.yaml").read_text(), "cell_plc")
    words = [word for value in (0.05, -0.05, 0.0125) for word in real(value)]
    assert plant.write(0, 1, 0, 1000, *words) == 16
    assert [plant.value(f"offset[{n}]") for n in range(3)] == [0.05, -0.05, 0.012500000186264515]
    assert plant.read(3, 6) == tuple(words)
    assert plant.write(0, 1, 0, 1000, words[0], words[1] + 1, *words[2:]) == 3


TWICE = (
    HEAD
    + SECTION
    + """\
variables:
  speed: {robot: input_double_register_0, owner: plc,
          modbus: [{holding: 10, type: float32}, {holding: 12, type: int16, scale: 0.1}]}
  go:    {robot: input_bit_register_0, owner: plc, modbus: [20.0, 20.5, 21.0, {coil: 7}, {coil: 9}]}
  other: {robot: input_bit_register_1, owner: plc, modbus: {coil: 8}}
"""
)


def test_a_request_of_two_minds_is_refused_and_the_reason_can_be_seen() -> None:
    """5 here and 7 there: 03, whole, with reason 12; what agrees as well as each type can is taken."""
    plant = Plant(TWICE)
    assert plant.write(10, *real(12.34), 123) == 16
    assert plant.value("speed") == 12.34000015258789
    assert plant.read(10, 3) == (*real(12.34), 123)
    assert plant.write(10, *real(50.0), 123) == 3
    assert plant.value("speed") == 12.34000015258789
    refused = plant.cell.last_refusal
    assert refused is not None
    assert refused.refusal.reason == 12
    assert refused.refusal.reason.text == "one request gave it two values"
    assert plant.write(10, *real(50.0)) == 16
    assert plant.write(12, 600) == 16
    assert plant.value("speed") == 60.0
    assert plant.write(10, *real(float("nan")), 0) == 16


def test_bits_and_coils_of_two_minds() -> None:
    """In one register, over two, by mask, and as coils."""
    plant = Plant(TWICE)
    assert plant.write(20, 0x21) == 16
    assert plant.value("go") is True
    assert plant.write(20, 0x01) == 3
    assert plant.write(20, 0x00, 0x01) == 3
    assert plant.write(20, 0x00, 0x00) == 16
    assert plant.value("go") is False
    mask_write = struct.Struct(">BHHH")
    assert plant.ask(mask_write.pack(22, 20, 0xFFDE, 0x0020)) == bytes((0x96, 3))
    assert plant.ask(mask_write.pack(22, 20, 0xFFDF, 0x0020))[0] == 22
    assert plant.value("go") is True
    coils = struct.Struct(">BHHBB")
    assert plant.ask(coils.pack(15, 7, 3, 1, 0b011)) == bytes((0x8F, 3))
    assert plant.ask(coils.pack(15, 7, 3, 1, 0b010))[0] == 15
    assert plant.value("go") is False


def test_the_order_of_a_file_leaves_single_registers_as_they_are() -> None:
    """DCBA for the double words; a `bool` is 1, not 256, and 16 bits are swapped only where they say so."""
    plant = Plant(
        HEAD
        + """\
modbus: {listen: '127.0.0.1:1502', order: DCBA}
variables:
  wide:    {robot: input_int_register_0, modbus: 10, owner: plc}
  narrow:  {robot: input_int_register_1, modbus: {holding: 12, type: uint16}, owner: plc}
  swapped: {robot: input_int_register_2, modbus: {holding: 13, type: uint16, order: BADC}, owner: plc}
  whole:   {robot: input_bit_register_0, modbus: {holding: 14, type: bool}, owner: plc}
  own:     {robot: input_bit_register_1, modbus: {holding: 15, type: bool, order: DCBA}, owner: plc}
  packed:  {robot: input_bit_register_2, modbus: 16.0, owner: plc}
"""
    )
    assert plant.write(10, 0x0403, 0x0201, 0x0102, 0x0201, 1, 1, 1) == 16
    names = ("wide", "narrow", "swapped", "whole", "own", "packed")
    assert [plant.value(name) for name in names] == [0x01020304, 0x0102, 0x0102, True, True, True]
    assert plant.read(10, 7) == (0x0403, 0x0201, 0x0102, 0x0201, 1, 1, 1)


GRIPPER = (
    HEAD
    + SECTION
    + """\
groups:
  grip: {owner: plc}
variables:
  width:  {robot: input_int_register_0, modbus: 0x64.high, group: grip, limits: [0, 255], on_release: hold}
  force:  {robot: input_double_register_0, group: grip, limits: [-0.5, 0.5],
           modbus: {holding: 0x64.low, type: int8, scale: 0.01}}
  state:  {robot: 'output_int_register_0..3', modbus: {input: 7.low}, limits: [0, 255]}
  half:   {robot: input_int_register_1, modbus: 0x65.low, owner: plc, limits: [0, 9]}
  jaw:    {robot: input_bit_register_0, modbus: 0x65.8, owner: plc}
"""
)


def test_bytes_of_a_register() -> None:
    """Two numbers in one register, as grippers have them; addresses in hexadecimal."""
    plant = Plant(GRIPPER)
    assert plant.write(100, 0xC8CE) == 16
    assert (plant.value("width"), plant.value("force")) == (200, -0.5)
    assert plant.read(100) == (0xC8CE,)
    mask_write = struct.Struct(">BHHH")
    assert plant.ask(mask_write.pack(22, 100, 0xFF00, 0x0032))[0] == 22
    assert (plant.value("width"), plant.value("force")) == (200, 0.5)
    assert plant.write(100, 0xC833) == 3, "0.51 is beyond the limits, and nothing of it is written"
    assert plant.read(100) == (0xC832,)
    for index, value in zip(plant.cell.image.outputs, (1, 2, 300, 4), strict=True):
        plant.cell.image.values[index] = value
    plant.unit.image.changed.add(Direction.OUTPUT)
    assert plant.ask(struct.pack(">BHH", 4, 7, 3)) == bytes((4, 6, 0, 1, 2, 255, 4, 0))


def test_a_byte_beside_a_bit() -> None:
    """What nothing is mapped to in their register takes no ones."""
    plant = Plant(GRIPPER)
    assert plant.write(101, 0x0107) == 16
    assert (plant.value("half"), plant.value("jaw")) == (7, True)
    assert plant.write(101, 0x0307) == 2
    assert plant.write(101, 0x000A) == 3
    assert plant.read(101) == (0x0107,)

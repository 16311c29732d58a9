"""Who meant what: two writers that read, change and write back, against an account that knows what they intended.

Both keep the words they once read and write them back late, by whole words, mask writes, coils and RPDO-like writes.
The account is naive: a bit belongs to whoever meant it last and has not let it go, and holds what that one meant.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition, Direction, Lock, ValueKind, Variable, Writer
from gatewayd.core.requester import Requester
from gatewayd.links.modbus_server.functions import Unit, execute
from gatewayd.links.modbus_server.plan import ModbusPlan, Placement
from gatewayd.modbus.areas import Area

PLC, HMI = range(2)
NOW = 1.0
WORD = 0
OWNERS = ((PLC,), (HMI,), (PLC, HMI), (PLC, HMI), (PLC, HMI))
"""By bit. The last two are one group: together with others in the register they are no exception."""
LOCK_OF = (0, 1, 2, 3, 3)
BITS = range(len(OWNERS))

writers = st.sampled_from([PLC, HMI])
masks = st.integers(0, (1 << len(OWNERS)) - 1)


def unit() -> Unit:
    field = "input_bit_registers0_to_31"
    variables = tuple(
        Variable(bit + 1, f"bit{bit}", Direction.INPUT, ValueKind.BOOL, field, bit=bit, lock=LOCK_OF[bit])
        for bit in BITS
    )
    locks = (
        Lock("mine", (0,), (PLC,)),
        Lock("theirs", (1,), (HMI,)),
        Lock("jog", (2,), (PLC, HMI)),
        Lock("pair", (3, 4), (PLC, HMI), takeover=True),
    )
    cell = Cell(CellDefinition("meaning", 1, variables, locks, (Writer("plc"), Writer("hmi")), 0.1))
    placements = [Placement(bit, Area.HOLDING, WORD, bit, None) for bit in BITS]
    placements += [Placement(bit, Area.COIL, bit, None, None) for bit in BITS]
    cell.robot_connected(0.0)
    cell.adopt(dict.fromkeys(BITS, False), 0.0)
    return Unit(ModbusPlan("", 0, 1, (), 1, None, False, tuple(placements), ()), cell)


@dataclass
class Meant:
    """What a writer wanted a bit to be, and that it still stands behind it."""

    writer: int
    value: bool


class Meaning(RuleBasedStateMachine):
    """No bit is ever owned by, or changed to the value of, a writer that did not mean it."""

    @initialize()
    def begin(self) -> None:
        self.unit = unit()
        self.cell = self.unit.cell
        self.read_once = {PLC: 0, HMI: 0}
        self.meant: dict[int, Meant] = {}

    def ask(self, writer: int, pdu: bytes) -> bool:
        return execute(self.unit, Requester(writer), pdu, NOW)[0] < 0x80

    def stand_behind(self, writer: int, bits: dict[int, bool]) -> None:
        for bit, value in bits.items():
            self.meant[bit] = Meant(writer, value)
            for other in BITS:  # a group has one owner; what a takeover did not write fell back
                before = self.meant.get(other)
                if other not in bits and LOCK_OF[other] == LOCK_OF[bit] and before is not None:
                    same = before.writer == writer
                    self.meant[other] = Meant(writer, before.value if same else False)

    @rule(writer=writers)
    def read(self, writer: int) -> None:
        """It keeps the word for later."""
        (self.read_once[writer],) = struct.unpack_from(">H", self.unit.image.holding.image, 2 * WORD)

    @rule(writer=writers, changed=masks, value=masks)
    def write_back(self, writer: int, changed: int, value: int) -> None:
        """The word it read once, with the bits that it means changed. It means only what it may own and does own."""
        own = sum(1 << bit for bit in BITS if self.owner(bit) == writer or OWNERS[bit] == (writer,))
        word = self.read_once[writer] & ~(changed & own) | value & changed & own
        if self.ask(writer, struct.pack(">BHH", 6, WORD, word)):
            self.stand_behind(writer, {bit: bool(word >> bit & 1) for bit in BITS if own >> bit & 1})

    @rule(writer=writers, mask=masks, value=masks)
    def write_masked(self, writer: int, mask: int, value: int) -> None:
        """Mask write (22): exactly what it names."""
        if self.ask(writer, struct.pack(">BHHH", 22, WORD, ~mask & 0xFFFF, value & mask)):
            self.stand_behind(writer, {bit: bool(value >> bit & 1) for bit in BITS if mask >> bit & 1})

    @rule(writer=writers, bit=st.sampled_from(BITS), value=st.booleans())
    def write_coil(self, writer: int, bit: int, value: bool) -> None:
        if self.ask(writer, struct.pack(">BHH", 5, bit, 0xFF00 if value else 0)):
            self.stand_behind(writer, {bit: value})

    @rule(writer=writers, bits=st.dictionaries(st.sampled_from(BITS), st.booleans(), min_size=1))
    def send_pdo(self, writer: int, bits: dict[int, bool]) -> None:
        """What is mapped in an RPDO is meant."""
        changes = [Change(bit, value) for bit, value in bits.items()]
        if self.cell.write(Requester(writer), changes, NOW) is None:
            self.stand_behind(writer, bits)

    @rule(writer=writers, bit=st.sampled_from(BITS))
    def request(self, writer: int, bit: int) -> None:
        former = self.owner(bit)
        if self.cell.request(Requester(writer), bit, NOW) is None and former != writer:
            for member in BITS:
                if LOCK_OF[member] == LOCK_OF[bit]:
                    self.meant[member] = Meant(writer, self.value(member))
                    assert former is None or not self.value(member), "a takeover starts from on_release"

    @rule(writer=writers)
    def lose(self, writer: int) -> None:
        """Its locks are released; what it meant is nobody's any more."""
        self.cell.release_all(Requester(writer), NOW)
        self.meant = {bit: meant for bit, meant in self.meant.items() if meant.writer != writer}

    def owner(self, bit: int) -> int | None:
        return self.cell.ownership.owners[LOCK_OF[bit]]

    def value(self, bit: int) -> bool:
        return bool(self.cell.image.values[bit])

    @invariant()
    def every_bit_is_what_somebody_meant(self) -> None:
        if not hasattr(self, "cell"):
            return
        for bit in BITS:
            meant, owner = self.meant.get(bit), self.owner(bit)
            if owner is not None and (meant is None or LOCK_OF[bit] == LOCK_OF[4]):
                group = [self.meant.get(other) for other in BITS if LOCK_OF[other] == LOCK_OF[bit]]
                assert any(one is not None and one.writer == owner for one in group)
            if meant is None:
                assert not self.value(bit), "released, and set again by nobody who meant it"
            else:
                assert (owner, self.value(bit)) == (meant.writer, meant.value)


TestMeaning = Meaning.TestCase
TestMeaning.settings = settings(max_examples=150, stateful_step_count=30, deadline=None)

"""Random requests of two writers and an undeclared peer against a model of one dictionary."""

from __future__ import annotations

import struct
from typing import Any

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition, Direction, Limits, Lock, ValueKind, Variable, Writer
from gatewayd.core.requester import Requester
from gatewayd.links.modbus_server.functions import Unit, execute
from gatewayd.links.modbus_server.plan import ModbusPlan, Placement
from gatewayd.modbus.areas import Area
from gatewayd.modbus.codec import make_codec

NOW = 1000.0
PLC, HMI, UNDECLARED = 0, 1, None
WRITERS = st.sampled_from([PLC, HMI, UNDECLARED])

# Registers 0..5 are uint16 limited to 0..999, 6 and 7 one int32, 8 has bits 0..3; coils 0..3 are those bits again.
NUMBERS, WIDE, BITS = range(6), 6, 8
OWNERS: dict[int, tuple[int, ...]] = {
    0: (PLC,), 1: (HMI,), 2: (PLC, HMI), 3: (PLC, HMI), 4: (HMI,), 5: (PLC, HMI), 6: (PLC, HMI),
    7: (PLC,), 8: (HMI,), 9: (PLC, HMI), 10: (PLC, HMI),
}  # fmt: skip
FIRST_BIT = 7


def unit_of_the_model() -> Unit:
    variables, placements = [], []
    for index in OWNERS:
        kind = ValueKind.BOOL if index >= FIRST_BIT else ValueKind.INT
        limits = Limits(0, 999) if index in NUMBERS else None
        low, high = (-(2**31), 2**31 - 1) if kind is ValueKind.INT else (None, None)
        variables.append(
            Variable(
                index + 1,
                f"v{index}",
                Direction.INPUT,
                kind,
                "in",
                low=low,
                high=high,
                limits=limits,
                lock=index,
            )
        )
        if index >= FIRST_BIT:
            placements.append(Placement(index, Area.HOLDING, BITS, index - FIRST_BIT, None))
            placements.append(Placement(index, Area.COIL, index - FIRST_BIT, None, None))
        else:
            codec = make_codec("int32" if index == WIDE else "uint16", kind=kind, low=low, high=high)
            placements.append(Placement(index, Area.HOLDING, index, None, codec))
    locks = tuple(Lock(f"v{index}", (index,), owners) for index, owners in OWNERS.items())
    cell = Cell(CellDefinition("model", 0, tuple(variables), locks, (Writer("plc"), Writer("hmi")), 0.1))
    cell.robot_connected(NOW)
    cell.adopt({}, NOW)
    return Unit(ModbusPlan("", 0, 1, (), 1, None, False, tuple(placements), ()), cell)


class Requests(RuleBasedStateMachine):
    """Every accepted write is in the model, every refused one changed nothing."""

    @initialize()
    def begin(self) -> None:
        self.unit = unit_of_the_model()
        self.values: dict[int, Any] = dict.fromkeys(OWNERS, 0)
        self.owners: dict[int, int] = {}

    def ask(self, writer: int | None, pdu: bytes) -> bytes:
        return execute(self.unit, Requester(writer), pdu, NOW)

    def judge(
        self, writer: int | None, written: dict[int, int], implied: frozenset[int] = frozenset()
    ) -> bool:
        """Whether the cell should take it; applies it if so."""
        if writer is None:
            return False
        accepted = {}
        for index, value in written.items():
            may = writer in OWNERS[index] and self.owners.get(index, writer) == writer
            if index in implied and self.owners.get(index) != writer and len(OWNERS[index]) > 1:
                may = False  # nobody takes by a whole word what another one may own too
            if not may and index in implied and value == self.values[index]:
                continue
            if not may or (index in NUMBERS and value > 999):
                return False
            accepted[index] = value
        self.values.update(accepted)
        self.owners.update(dict.fromkeys(accepted, writer))
        return True

    def word(self, address: int) -> int:
        """What a register should hold."""
        if address == BITS:
            return sum(int(self.values[FIRST_BIT + bit]) << bit for bit in range(4))
        if address in (WIDE, WIDE + 1):
            return int((self.values[WIDE] & 0xFFFFFFFF) >> (16 if address == WIDE else 0) & 0xFFFF)
        return int(self.values[address])

    def meant(self, address: int, words: list[int]) -> dict[int, int] | None:
        """Variable -> value; None if the range is not whole variables."""
        end = address + len(words)
        if end > BITS + 1 or address == WIDE + 1 or end == WIDE + 1:
            return None
        written = {number: words[number - address] for number in NUMBERS if address <= number < end}
        if address <= WIDE < end:
            (written[WIDE],) = struct.unpack(
                ">i", struct.pack(">HH", *words[WIDE - address : WIDE - address + 2])
            )
        if address <= BITS < end and words[BITS - address] & ~0xF:
            return None
        if address <= BITS < end:
            written |= {FIRST_BIT + bit: words[BITS - address] >> bit & 1 for bit in range(4)}
        return written

    @rule(
        writer=WRITERS,
        address=st.integers(0, 9),
        words=st.lists(st.integers(0, 1100), min_size=1, max_size=9),
    )
    def write_registers(self, writer: int | None, address: int, words: list[int]) -> None:
        data = struct.pack(f">{len(words)}H", *words)
        answer = self.ask(writer, struct.pack(">BHHB", 16, address, len(words), len(data)) + data)
        written = self.meant(address, words)
        taken = written is not None and self.judge(
            writer, written, frozenset(range(FIRST_BIT, FIRST_BIT + 4))
        )
        assert (answer[0] == 16) is taken

    @rule(writer=WRITERS, coil=st.integers(0, 4), bits=st.lists(st.booleans(), min_size=1, max_size=4))
    def write_coils(self, writer: int | None, coil: int, bits: list[bool]) -> None:
        packed = sum(int(bit) << place for place, bit in enumerate(bits))
        answer = self.ask(writer, struct.pack(">BHHBB", 15, coil, len(bits), 1, packed))
        written = {FIRST_BIT + coil + place: int(bit) for place, bit in enumerate(bits)}
        assert (answer[0] == 15) is (coil + len(bits) <= 4 and self.judge(writer, written))

    @rule(writer=WRITERS, and_mask=st.integers(0, 65535), or_mask=st.integers(0, 65535))
    def mask_bits(self, writer: int | None, and_mask: int, or_mask: int) -> None:
        answer = self.ask(writer, struct.pack(">BHHH", 22, BITS, and_mask, or_mask))
        selected = ~and_mask & 0xFFFF
        written = {FIRST_BIT + bit: or_mask >> bit & 1 for bit in range(4) if selected >> bit & 1}
        lost = or_mask & selected & ~0xF or (selected and not written)
        assert (answer[0] == 22) is (not lost and self.judge(writer, written))

    @rule(writer=WRITERS, address=st.sampled_from(NUMBERS), value=st.integers(0, 1100))
    def write_and_read(self, writer: int | None, address: int, value: int) -> None:
        answer = self.ask(writer, struct.pack(">BHHHHBH", 23, 0, 9, address, 1, 2, value))
        if self.judge(writer, {address: value}):
            assert answer == bytes((23, 18)) + struct.pack(">9H", *map(self.word, range(9)))
        else:
            assert answer[0] == 0x97

    @rule(writer=st.sampled_from([PLC, HMI]))
    def release_all(self, writer: int) -> None:
        """Released inputs are cleared."""
        assert self.ask(writer, struct.pack(">BHH", 6, 60041, 0xFFFF))[0] == 6
        for index, owner in list(self.owners.items()):
            if owner == writer:
                del self.owners[index]
                self.values[index] = 0

    @rule(address=st.integers(0, 10), count=st.integers(1, 10))
    def read_registers(self, address: int, count: int) -> None:
        answer = self.ask(UNDECLARED, struct.pack(">BHH", 3, address, count))
        if address + count > BITS + 1:
            assert answer == bytes((0x83, 2))
        else:
            assert answer[2:] == struct.pack(f">{count}H", *map(self.word, range(address, address + count)))

    @invariant()
    def coils_and_registers_tell_the_same(self) -> None:
        assert self.ask(UNDECLARED, struct.pack(">BHH", 1, 0, 4))[2] == self.word(BITS)
        assert self.ask(UNDECLARED, struct.pack(">BHH", 3, 0, 9))[2:] == struct.pack(
            ">9H", *map(self.word, range(9))
        )


TestRequests = Requests.TestCase
TestRequests.settings = settings(max_examples=40, stateful_step_count=40)

"""Requests that come again are answered as they were the first time: held against a unit that remembers none."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gatewayd.core.cell import Cell
from gatewayd.core.requester import Requester
from gatewayd.links.modbus_server.functions import Unit
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.links.modbus_server.session import ModbusSession, UnitAccess
from gatewayd.links.modbus_server.usual import CAPACITY, UsualWrites
from gatewayd.mapping.loader import load
from gatewayd.modbus.frames import encode

MAPPING = """\
gatewayd: 1
cell: press
robot: {host: 127.0.0.10}
modbus: {listen: '127.0.0.1:1502', %s}
writers:
  plc: {modbus: 127.0.0.2, timeout: 1s}
  hmi: {modbus: 127.0.0.3}
variables:
  go: {robot: input_bit_register_64, modbus: 0.0, owner: plc}
  stop: {robot: input_bit_register_65, modbus: 0.1, owner: [plc, hmi], takeover: true}
  lamps: {robot: input_bit_register_66..69, modbus: 1.4, owner: [plc, hmi], lease: 1 s}
  whole: {robot: input_int_register_24, modbus: 2, owner: [plc, hmi], limits: [-100, 100]}
  small: {robot: input_int_register_25, modbus: {holding: 4, type: int16}, owner: plc, limits: [-5, 5], clamp: true}
  scaled: {robot: input_int_register_26, modbus: {holding: 5, type: int16, scale: 0.5, order: DCBA}, owner: [plc, hmi]}
  real:
    modbus: {holding: 6, type: float32, order: CDAB}
    robot: input_double_register_24
    limits: [-0.05, 0.05]
    owner: plc
  tenths: {robot: input_double_register_25, modbus: {holding: 8, type: uint16, scale: 0.1}, owner: [hmi, plc]}
  exact: {robot: input_double_register_26, modbus: 9, owner: [plc, hmi], lease: 1 s}
  twice: {robot: input_int_register_27, modbus: [{holding: 14, type: int16}, {holding: 15, type: int32}], owner: plc}
  coil: {robot: input_bit_register_70..79, modbus: {coil: 20}, owner: [plc, hmi]}
"""
CHANGEABLE = ("", "write_gaps: ignore", "gaps: zero")


class Plant:
    """A unit and its two writers, each with a connection."""

    def __init__(self, gaps: str, *, remembers: bool) -> None:
        loaded = load((MAPPING % gaps).replace(", }", "}").encode(), "press.yaml")
        assert loaded.plan is not None, [finding.message for finding in loaded.diagnostics]
        self.cell = Cell(loaded.plan.cell)
        self.unit = Unit(loaded.plan.the(ModbusPlan), self.cell)
        self.cell.robot_connected(0.0)
        self.cell.adopt({index: self.cell.image.values[index] for index in self.cell.image.inputs}, 0.0)
        if not remembers:
            self.unit.usual_registers = UsualWrites(self.cell, lambda _address, _count: None)
            self.unit.usual_coils = UsualWrites(self.cell, lambda _address, _count: None)
        self.sessions = [ModbusSession() for _ in range(2)]
        for writer, session in enumerate(self.sessions):
            requester = Requester(writer, "", writer + 1)
            self.cell.writer_connected(requester, 0.0)
            session.serve({1: UnitAccess(self.unit, requester)})
        self.audit: list[object] = []
        self.cell.write_listeners.append(lambda *written: self.audit.append(written))

    def ask(self, writer: int, pdu: bytes, now: float) -> bytes:
        session, frame = self.sessions[writer], encode(1, 1, pdu)
        session.buffer.space[0][: len(frame)] = frame
        return session.received(len(frame), now)

    def state(self) -> str:
        """As text, in which NaN is NaN."""
        cell = self.cell
        state = (
            (cell.image.values, cell.image.times, cell.image.quality, cell.delivery.given_at),
            (cell.ownership.owners, cell.ownership.expires, cell.ownership.connections),
            (cell.writers.last_seen, cell.writers.alive, cell.health, list(cell.events), self.audit),
            (self.unit.ignored, cell.last_refusal),
            (bytes(self.unit.image.holding.image), bytes(self.unit.image.coils.image)),
        )
        return repr(state)


words = st.one_of(
    st.integers(0, 0xFFFF),
    st.sampled_from([0, 0, 1, 2, 4, 5, 6, 0xFFFB, 0x3D4C, 0xCCCD, 0x7FC0, 0x00F0, 0x0010, 0x8000, 0x7FF0]),
)


@st.composite
def registers(draw: st.DrawFn) -> bytes:
    address, count = draw(
        st.sampled_from(
            [
                (0, 1),
                (0, 2),
                (0, 4),
                (2, 2),
                (2, 7),
                (0, 13),
                (4, 1),
                (6, 2),
                (8, 5),
                (9, 4),
                (14, 3),
                (15, 2),
                (12, 2),
                (3, 2),
            ]
        )
    )
    data = struct.pack(f">{count}H", *draw(st.lists(words, min_size=count, max_size=count)))
    if count == 1 and draw(st.booleans()):
        return struct.pack(">BH", 6, address) + data
    if draw(st.integers(0, 5)) == 0:
        return struct.pack(">BHHHHB", 23, 0, 4, address, count, len(data)) + data
    return struct.pack(">BHHB", 16, address, count, len(data)) + data


@st.composite
def coils(draw: st.DrawFn) -> bytes:
    address, count = draw(st.sampled_from([(20, 10), (20, 1), (22, 3), (24, 8), (19, 2)]))
    if count == 1 and draw(st.booleans()):
        return struct.pack(">BHH", 5, address, draw(st.sampled_from([0, 0xFF00])))
    size = (count + 7) // 8
    return struct.pack(">BHHB", 15, address, count, size) + draw(st.binary(min_size=size, max_size=size))


requests = st.one_of(registers(), registers(), coils(), st.just(struct.pack(">BHH", 6, 60041, 0xFFFF)))
steps = st.tuples(
    st.sampled_from([0, 0, 0, 1]), requests, st.integers(1, 3), st.sampled_from([0.0, 0.1, 0.6, 1.1])
)


@pytest.mark.parametrize("gaps", CHANGEABLE, ids=["as declared", "gaps ignored", "gaps zero"])
@settings(max_examples=60)
@given(acts=st.lists(steps, max_size=12))
def test_the_second_answer_is_the_first(gaps: str, acts: list[tuple[int, bytes, int, float]]) -> None:
    usual, thorough = Plant(gaps, remembers=True), Plant(gaps, remembers=False)
    now = 0.0
    for writer, pdu, times, pause in acts:
        now += pause
        for plant in (usual, thorough):
            plant.cell.tick(now)
        for _ in range(times):
            assert usual.ask(writer, pdu, now) == thorough.ask(writer, pdu, now)
            assert usual.state() == thorough.state()


def test_what_was_accepted_is_worked_out_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The thorough way is not taken again, until the lock has another owner."""
    plant = Plant("", remembers=True)
    request = struct.pack(">BHHBi", 16, 2, 2, 4, 7)
    assert plant.ask(1, request, 1.0)[7] == 16
    looked_at: list[int] = []
    monkeypatch.setattr(plant.cell, "write", lambda *_: looked_at.append(1))
    assert plant.ask(1, request, 1.1)[7] == 16
    assert looked_at == []
    plant.cell.operator.free_lock(plant.cell.definition.variables[6].lock or 0, 1.2)
    plant.ask(1, request, 1.3)
    assert looked_at == [1]


def test_what_is_refused_is_not_kept() -> None:
    plant = Plant("", remembers=True)
    for value in range(10):
        assert plant.ask(1, struct.pack(">BHHBH", 16, 4, 1, 2, value), 1.0)[7] & 0x80
    assert not plant.unit.usual_registers._known


def test_it_keeps_no_more_than_its_capacity() -> None:
    usual = UsualWrites(Plant("", remembers=True).cell, lambda _address, _count: None)
    for address in range(CAPACITY + 10):
        usual.accepted(address, 1)
    assert len(usual._known) == CAPACITY
    assert min(usual._known) == (10, 1)

"""Rockwell's client told what to do, and the handshake: what they hold, and stepped through."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from gatewayd.links.exports import ExportError
from gatewayd.links.modbus_server.plc.build import model_of
from gatewayd.links.modbus_server.plc.logix.client import (
    DATA_SIZE,
    MAX_BITS,
    MAX_REGISTERS,
    TooMuch,
    client,
    transactions,
)
from gatewayd.links.modbus_server.plc.logix.handshake import handshake
from gatewayd.links.modbus_server.plc.model import PlcModel
from gatewayd.links.modbus_server.plc.registry import files_for
from gatewayd.plc.st.dialect import elementary
from gatewayd.plc.st.program import PlcVariable, ProgramUnit, VariableSection
from gatewayd.plc.tags import PlcWishes
from tests.links.modbus_server.plc.cells import complete_plan, model, plan_of
from tests.links.modbus_server.plc.simulation import CYCLE, instance
from tests.plc_golden import golden_model

PART = "part: {robot: input_int_register_0, modbus: {holding: 1, type: uint16}, owner: plc}"
SHARED = "speed: {robot: input_double_register_0, modbus: {holding: 8, type: float32}, owner: [plc, hmi]}"
WIDE = "wide: {robot: 'output_double_register_0..23', modbus: {holding: 101, type: float64}}"


def test_no_request_is_larger_than_the_client_takes() -> None:
    """A value of several registers is never read by halves."""
    found = model("a: {robot: output_int_register_0, modbus: {holding: 100, type: int16}}", WIDE)
    (whole,) = found.reads
    assert whole.count > MAX_REGISTERS - 24
    plan = transactions(found)
    parts = [each for each in plan if each.poll is whole]
    assert all(each.count <= MAX_REGISTERS for each in plan)
    starts = {tag.address - whole.address for tag in whole.tags}
    assert {each.first for each in parts} <= starts
    assert sum(each.count for each in parts) == whole.count


def test_what_is_in_the_clients_data_does_not_overlap() -> None:
    used: set[tuple[object, int]] = set()
    for each in transactions(golden_model()):
        places = {(each.poll.area, each.local + index) for index in range(each.count)}
        assert not places & used
        used |= places
    assert max(index for _area, index in used) < DATA_SIZE


def test_truths_go_in_smaller_requests() -> None:
    found = model("a: {robot: 'output_bit_register_0..63', modbus: {discrete: 0}}")
    assert all(each.count <= MAX_BITS for each in transactions(found))


def test_a_cell_that_is_too_large_says_so_and_has_no_client() -> None:
    found = model_of(complete_plan(), PlcWishes())
    with pytest.raises(TooMuch, match=r"\d+ (elements of HoldRegisters_4xxx|transactions), and it"):
        transactions(found)
    files = {file.name: file.text for file in files_for("studio5000", found)}
    assert "GW_Client.L5X" not in files
    assert "Rockwell's client cannot hold this cell" in files["GW_Main.L5X"]


def test_a_host_by_name_is_refused() -> None:
    found = model_of(plan_of(PART), PlcWishes(writer="plc", host="gateway.example.org"))
    with pytest.raises(ExportError, match="Rockwell's Modbus client takes an IPv4 address"):
        files_for("studio5000", found)


class Client:
    """Tags of the routine, and Rockwell's client: TransComplete falls with a request and rises with its answer."""

    def __init__(self, found: PlcModel) -> None:
        plan = transactions(found)
        text = SimpleNamespace(LEN=0, DATA=[0] * 16)
        self.transactions = [
            SimpleNamespace(Enabled=False, TransComplete=False, TransStat=0) for _each in plan
        ]
        self.writes = [number for number, each in enumerate(plan) if each.poll.writes]
        self.status = SimpleNamespace(trusted=True)
        self.tags: dict[str, Any] = {
            "GW_Client_EN": 0,
            "GW_Client_Parameters": SimpleNamespace(DestAddress=text),
            "GW_Client_Transactions": self.transactions,
            "GW_Status": self.status,
            "GW_Was": [False] * len(plan),
            "GW_Confirmed": [0] * len(plan),
            "GW_All_Written": 0,
            "GW_Demand_write2": False,
        }
        names = [*self.tags, "GW_Write", "GW_Written"]
        fields = tuple(PlcVariable(name, elementary("DINT")) for name in names)
        body = [
            line.partition(" //")[0] for line in client(found, plan) if not line.startswith(("//", "COP("))
        ]
        unit = ProgramUnit("PROGRAM", "routine", (VariableSection("VAR", fields),), tuple(body))
        self.own, self.call = instance(unit, **self.tags)

    def answer(self, *numbers: int, status: int = 0) -> int:
        """These are sent and answered; what has been confirmed since."""
        for number in numbers:
            self.transactions[number].TransComplete = False
        self.call()
        for number in numbers:
            self.transactions[number].TransComplete = True
            self.transactions[number].TransStat = status
        self.call()
        return int(self.own.GW_Written)


def test_nothing_is_written_before_it_may_be() -> None:
    found = Client(model(PART))
    (write,) = found.writes
    found.call()
    assert not found.transactions[write].Enabled
    found.own.GW_Write = True
    found.call()
    assert found.transactions[write].Enabled
    found.status.trusted = False
    found.call()
    assert not found.transactions[write].Enabled


def test_the_client_is_told_where_the_gateway_is() -> None:
    found = Client(model(PART))
    found.call()
    told = found.own.GW_Client_Parameters
    assert bytes(told.DestAddress.DATA[: told.DestAddress.LEN]) == b"127.0.0.1"
    assert told.DestinationPort == 1502
    first = found.transactions[0]
    assert (first.TransType, first.BeginAddress, first.StationID, first.PollInterval) == (3, 60000, 1, 100)


def test_a_round_counts_when_every_write_was_confirmed() -> None:
    """Also what is on demand, while it is demanded; an exception is no confirmation."""
    found = Client(model(PART, SHARED))
    own, shared = found.writes
    found.own.GW_Write = True
    assert found.answer(own) == 1
    found.own.GW_Demand_write2 = True
    found.call()
    assert found.answer(own) == 1
    assert found.answer(shared, status=-1) == 1
    assert found.answer(shared) == 2


class Hand:
    """The tags of the handshake, with time in cycles."""

    def __init__(self) -> None:
        self.elapsed = 0
        self.shake = SimpleNamespace(
            **dict.fromkeys(
                (
                    "send",
                    "acknowledge",
                    "toggle",
                    "busy",
                    "done",
                    "failed",
                    "sent",
                    "state",
                    "since",
                    "time_out",
                ),
                0,
            ),
            expiry=SimpleNamespace(PRE=0, TimerEnable=0, DN=0),
        )
        self.status = SimpleNamespace(trusted=True)
        lines = [
            line.replace("TONR(GW_Handshake.expiry);", "GW_Handshake.expiry.DN := tick();")
            for line in handshake(model(PART))
        ]
        fields = tuple(
            PlcVariable(name, elementary("DINT")) for name in ("GW_Handshake", "GW_Status", "GW_Written")
        )
        unit = ProgramUnit("PROGRAM", "routine", (VariableSection("VAR", fields),), tuple(lines))
        self.own, self.call = instance(
            unit, {"tick": self._tick}, GW_Handshake=self.shake, GW_Status=self.status
        )

    def _tick(self) -> bool:
        self.elapsed = self.elapsed + CYCLE if self.shake.expiry.TimerEnable else 0
        return bool(self.elapsed > self.shake.expiry.PRE)

    def begin(self) -> None:
        self.call()
        self.shake.send = True
        self.call()


def test_the_toggle_changes_when_the_data_are_there() -> None:
    """The third round is the first that surely began after them."""
    hand = Hand()
    hand.begin()
    for rounds, toggle in ((1, False), (2, False), (3, True)):
        hand.own.GW_Written = rounds
        hand.call()
        assert bool(hand.shake.toggle) == toggle
    assert (hand.shake.busy, hand.shake.done) == (True, 0)
    hand.shake.acknowledge = True
    hand.call()
    assert (hand.shake.busy, hand.shake.done) == (False, 1)
    hand.call()
    assert not hand.shake.busy


@pytest.mark.parametrize("lost", [True, False])
def test_a_handshake_that_nobody_answers_fails(lost: bool) -> None:
    hand = Hand()
    hand.shake.time_out = 200
    hand.begin()
    hand.status.trusted = not lost
    cycles = 1 if lost else 200 // CYCLE + 2
    for _cycle in range(cycles):
        hand.call()
    assert (hand.shake.failed, hand.shake.done, bool(hand.shake.busy)) == (1, 0, False)

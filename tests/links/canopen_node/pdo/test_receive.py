"""What a received RPDO does to the cell, at explicit times."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from gatewayd.canopen.datatypes import CanType
from gatewayd.core.admission import Change
from gatewayd.core.definition import Direction
from gatewayd.core.requester import Requester
from gatewayd.links.canopen_node.pdo.codec import Layout, Mapped
from gatewayd.links.canopen_node.pdo.parameters import Configuration
from gatewayd.links.canopen_node.pdo.receive import Fault, ReceiveEngine

Bench = Any
"""`Bench` of conftest.py, which cannot be imported."""

T = 2000.0
LINE, PLC = 0, 1


class Receiver:
    """An engine with one RPDO 205h, in OPERATIONAL since T; `reported` is what the node would make EMCYs of."""

    def __init__(self, bench: Bench, *names: str, writer: int | None = LINE, **parameters: Any) -> None:
        self.bench = bench
        self.reported: list[str] = []
        self.requester = Requester(writer)
        self.engine = ReceiveEngine(
            bench.cell,
            lambda _number, _now: self.requester,
            lambda _number: self.requester,
            lambda fault, number, _now: self.reported.append(f"+{fault.name} {number}"),
            lambda fault, number, _now: self.reported.append(f"-{fault.name} {number}"),
        )
        if names:
            self.configure(1, *names, **parameters)
        self.engine.nmt(operational=True, now=T)

    def configure(self, number: int, *names: str, **parameters: Any) -> None:
        parameters = {"number": number, "can_id": 0x205, **parameters}
        self.engine.configure(number, self.bench.configuration(names, **parameters))

    def receive(self, data: str, after: float = 0.0, can_id: int = 0x205, *, heard: bool = True) -> list[str]:
        """What was reported of this frame."""
        self.requester = replace(self.requester, trusted=heard)
        self.engine.receive(can_id, bytes.fromhex(data), T + after)
        return self.take()

    def take(self) -> list[str]:
        reported, self.reported = self.reported, []
        return reported

    def value(self, name: str) -> Any:
        return self.bench.value(name)


# -- types -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("transmission", [254, 255])
def test_event_driven_rpdo_is_written_at_once(bench: Bench, transmission: int) -> None:
    receiver = Receiver(bench, "in_int_0", "in_short_0", transmission=transmission)
    assert receiver.receive("01000000feff") == []
    assert (receiver.value("in_int_0"), receiver.value("in_short_0")) == (1, -2)


@pytest.mark.parametrize("transmission", [0, 1, 240])
def test_synchronous_rpdo_waits_for_sync_and_the_newest_wins(bench: Bench, transmission: int) -> None:
    receiver = Receiver(bench, "in_int_0", transmission=transmission)
    receiver.receive("01000000")
    receiver.receive("02000000")
    assert receiver.value("in_int_0") == 0
    receiver.engine.on_sync(T)
    assert receiver.value("in_int_0") == 2
    bench.cell.write(Requester(LINE), [Change(bench.by_name["in_int_0"], 9)], T)
    receiver.engine.on_sync(T)
    assert receiver.value("in_int_0") == 9, "what was written once is not written again"


def test_what_waits_for_sync_is_dropped_when_operational_is_left(bench: Bench) -> None:
    receiver = Receiver(bench, "in_int_0", transmission=1)
    receiver.receive("01000000")
    receiver.engine.nmt(operational=False, now=T)
    receiver.engine.nmt(operational=True, now=T)
    receiver.engine.on_sync(T)
    assert receiver.value("in_int_0") == 0


def test_nothing_is_received_outside_operational(bench: Bench) -> None:
    receiver = Receiver(bench, "in_int_0", event=0.1)
    receiver.engine.nmt(operational=False, now=T)
    assert receiver.receive("01000000") == []
    assert receiver.receive("01") == []
    assert receiver.value("in_int_0") == 0
    assert receiver.engine.next_deadline() == math.inf


def test_one_pdo_is_one_write(bench: Bench) -> None:
    receiver = Receiver(bench, "in_int_0", "in_int_1")
    notices: list[Direction] = []
    bench.cell.listeners.append(notices.append)
    receiver.receive("0100000002000000")
    assert notices == [Direction.INPUT]


def test_several_rpdos_may_listen_to_one_identifier(bench: Bench) -> None:
    receiver = Receiver(bench, "in_int_0")
    receiver.configure(2, "in_short_0", "in_short_1")
    receiver.receive("05000600")
    assert (receiver.value("in_int_0"), receiver.value("in_short_1")) == (0x60005, 6)
    assert receiver.engine.can_ids == {0x205}


def test_foreign_identifiers_are_left_alone(bench: Bench) -> None:
    receiver = Receiver(bench, "in_int_0")
    assert not receiver.engine.receive(0x206, bytes(4), T)
    assert receiver.engine.receive(0x205, bytes(4), T)


def test_dummies_are_skipped(bench: Bench) -> None:
    receiver = Receiver(bench, "dummy_6", "in_short_0")
    receiver.receive("ffff0700")
    assert receiver.value("in_short_0") == 7


# -- length ------------------------------------------------------------------------------------------------------


def test_short_rpdo_is_dropped_and_reported_once_until_a_right_one(bench: Bench) -> None:
    receiver = Receiver(bench, "in_int_0")
    assert receiver.receive("010000") == ["+SHORT 1"]
    assert receiver.receive("") == []
    assert receiver.value("in_int_0") == 0
    assert receiver.receive("01000000") == ["-SHORT 1"]
    assert receiver.receive("010000") == ["+SHORT 1"]
    assert Fault.SHORT.value == 0x8210


def test_of_a_long_rpdo_the_first_bytes_are_used(bench: Bench) -> None:
    receiver = Receiver(bench, "in_int_0")
    assert receiver.receive("0100000099") == ["+LONG 1"]
    assert receiver.value("in_int_0") == 1
    assert receiver.receive("0200000099") == []
    assert receiver.value("in_int_0") == 2
    assert receiver.receive("03000000") == ["-LONG 1"]
    assert Fault.LONG.value == 0x8220


# -- deadline ----------------------------------------------------------------------------------------------------


def test_deadline_runs_from_the_first_frame_and_is_reported_once(bench: Bench) -> None:
    receiver = Receiver(bench, "in_int_0", event=0.125)
    receiver.engine.tick(T + 5)
    assert receiver.take() == []
    receiver.receive("01000000", after=5)
    assert receiver.engine.next_deadline() == T + 5.125
    receiver.receive("01000000", after=5.0625)
    receiver.engine.tick(T + 5.125)
    assert receiver.take() == [], "a frame starts the deadline anew"
    assert receiver.engine.next_deadline() == T + 5.1875
    receiver.engine.tick(T + 5.1875)
    assert receiver.take() == ["+TIMEOUT 1"]
    receiver.engine.tick(T + 9)
    assert receiver.take() == []
    assert receiver.engine.next_deadline() == math.inf
    assert receiver.receive("01000000", after=10) == ["-TIMEOUT 1"]
    receiver.engine.tick(T + 10.125)
    assert receiver.take() == ["+TIMEOUT 1"]
    assert Fault.TIMEOUT.value == 0x8250


def test_short_frames_do_not_keep_the_deadline(bench: Bench) -> None:
    receiver = Receiver(bench, "in_int_0", event=0.1)
    receiver.receive("01000000")
    receiver.receive("01", after=0.09)
    receiver.engine.tick(T + 0.1)
    assert "+TIMEOUT 1" in receiver.take()


def test_leaving_operational_stops_the_deadline_and_clears_what_was_reported(bench: Bench) -> None:
    receiver = Receiver(bench, "in_int_0", event=0.1)
    receiver.receive("01000000")
    receiver.engine.tick(T + 0.1)
    receiver.take()
    receiver.engine.nmt(operational=False, now=T + 1)
    assert receiver.take() == ["-TIMEOUT 1"]
    receiver.engine.nmt(operational=True, now=T + 2)
    receiver.engine.tick(T + 9)
    assert receiver.take() == []


# -- refusals ----------------------------------------------------------------------------------------------------


def test_refused_rpdo_changes_nothing_and_is_reported_once_until_a_write_succeeds(bench: Bench) -> None:
    receiver = Receiver(bench, "in_int_0", "in_int_1")
    index = bench.by_name["in_int_1"]
    line_ranks_first = Receiver(bench, "in_int_0", writer=PLC)
    assert line_ranks_first.receive("07000000") == []
    bench.cell.write(Requester(PLC), [Change(index, 5)], T)
    assert receiver.receive("0100000002000000") == ["+HELD 1"]
    assert receiver.receive("0100000002000000") == []
    assert (receiver.value("in_int_0"), receiver.value("in_int_1")) == (7, 5)
    assert bench.cell.health.writes_refused == 2
    bench.cell.release_all(Requester(PLC), T)
    assert receiver.receive("0100000002000000") == ["-HELD 1"]
    assert receiver.value("in_int_1") == 2


def test_each_cause_is_reported_and_all_are_cleared_together(limited_bench: Bench) -> None:
    receiver = Receiver(limited_bench, "in_int_0")
    assert receiver.receive("64000000") == ["+OUT_OF_LIMITS 1"]
    limited_bench.cell.robot_lost("cut", T)
    assert receiver.receive("01000000") == ["+ROBOT_LOST 1"]
    assert receiver.engine.pdos[0].faults == {Fault.OUT_OF_LIMITS, Fault.ROBOT_LOST}
    limited_bench.cell.robot_connected(T)
    limited_bench.cell.adopt({}, T)
    assert receiver.receive("01000000") == ["-OUT_OF_LIMITS 1", "-ROBOT_LOST 1"]
    assert receiver.engine.pdos[0].faults == set()


def test_register_that_was_claimed_elsewhere_has_its_own_cause(bench: Bench) -> None:
    receiver = Receiver(bench, "in_int_0")
    bench.cell.set_availability([bench.by_name["in_int_0"]], available=False, reason="in use", now=T)
    assert receiver.receive("01000000") == ["+CLAIMED_ELSEWHERE 1"]


def test_without_a_writer_every_rpdo_is_refused(bench: Bench) -> None:
    receiver = Receiver(bench, "in_int_0", writer=None)
    assert receiver.receive("01000000") == ["+NOT_WRITABLE 1"]
    assert bench.cell.health.writes_refused == 1


def test_number_that_the_variable_cannot_be_is_out_of_limits(bench: Bench) -> None:
    receiver = Receiver(bench)
    mapping = (Mapped(bench.by_name["in_int_0"], CanType.REAL32),)
    layout = Layout(mapping, bench.variables)
    receiver.engine.configure(1, Configuration(1, 0x205, 255, mapping, layout))
    assert receiver.receive("0000c07f") == ["+OUT_OF_LIMITS 1"]
    assert bench.cell.health.writes_refused == 1
    assert receiver.receive("00004040") == ["-OUT_OF_LIMITS 1"]
    assert receiver.value("in_int_0") == 3


def test_faults_of_one_pdo_are_not_those_of_another(bench: Bench) -> None:
    receiver = Receiver(bench, "in_int_0")
    receiver.configure(2, "in_int_1", can_id=0x305)
    assert receiver.receive("01") == ["+SHORT 1"]
    assert receiver.receive("01", can_id=0x305) == ["+SHORT 2"]
    assert receiver.receive("01000000") == ["-SHORT 1"]
    assert [pdo.faults for pdo in receiver.engine.pdos] == [set(), {Fault.SHORT}]


def test_configuring_a_pdo_anew_clears_its_faults(bench: Bench) -> None:
    receiver = Receiver(bench, "in_int_0")
    receiver.receive("01")
    receiver.engine.configure(1, None)
    assert receiver.take() == ["-SHORT 1"]
    assert not receiver.engine.receive(0x205, bytes(4), T)


# -- ownership ---------------------------------------------------------------------------------------------------


def test_a_bit_of_another_owner_refuses_the_whole_pdo(bench: Bench) -> None:
    """What is mapped into an RPDO is meant: there is no masked form of it."""
    bench.cell.write(Requester(PLC), [Change(bench.by_name["in_bit_1"], True)], T)
    receiver = Receiver(bench, "in_bit_0", "in_bit_1")
    assert receiver.receive("03") == ["+HELD 1"]
    assert receiver.value("in_bit_0") is False
    bench.cell.release_all(Requester(PLC), T)
    assert receiver.receive("03") == ["-HELD 1"]
    assert receiver.value("in_bit_0") is receiver.value("in_bit_1") is True
    assert len(bench.cell.ownership.held_by(LINE)) == 2


def test_equal_content_is_written_again_and_keeps_the_owner(bench: Bench) -> None:
    receiver = Receiver(bench, "in_int_0")
    receiver.receive("01000000")
    bench.cell.release_all(Requester(LINE), T)
    assert receiver.value("in_int_0") == 0
    receiver.receive("01000000")
    assert receiver.value("in_int_0") == 1


def test_every_usable_frame_is_a_sign_of_life(bench: Bench) -> None:
    receiver = Receiver(bench, "in_int_0")
    receiver.receive("01", after=1)
    assert not bench.cell.writers.alive[LINE]
    bench.cell.robot_lost("cut", T)
    receiver.receive("01000000", after=2)
    assert bench.cell.writers.last_seen[LINE] == T + 2


def test_bits_beyond_the_mapping_in_the_last_byte_mean_nothing(bench: Bench) -> None:
    receiver = Receiver(bench, "in_bit_0", "in_bit_1", "in_bit_2")
    assert receiver.receive("fa") == []
    assert [receiver.value(f"in_bit_{bit}") for bit in range(4)] == [False, True, False, False]


@pytest.mark.parametrize("transmission", [1, 255])
def test_rpdo_of_a_writer_that_is_not_heard_is_refused_as_it_comes(bench: Bench, transmission: int) -> None:
    receiver = Receiver(bench, "in_int_0", transmission=transmission)
    assert receiver.receive("01000000", heard=False) == ["+HEARTBEAT_LOST 1"]
    assert receiver.receive("02000000", heard=False) == []
    receiver.engine.on_sync(T)
    assert (receiver.value("in_int_0"), bench.cell.health.writes_refused) == (0, 2)
    assert not bench.cell.writers.alive[LINE]
    reported = receiver.receive("03000000")
    receiver.engine.on_sync(T)
    assert reported + receiver.take() == ["-HEARTBEAT_LOST 1"]
    assert receiver.value("in_int_0") == 3

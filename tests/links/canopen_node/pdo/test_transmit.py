"""When a TPDO is sent, at explicit times."""

from __future__ import annotations

import math
import struct
from typing import Any

import pytest

from gatewayd.core.definition import Fallback, FallbackKind
from gatewayd.links.canopen_node.pdo.transmit import MOVES, Schedule, TransmitEngine, TransmitSignal

Bench = Any
"""`Bench` of conftest.py, which cannot be imported."""

T = 2000.0


class Sender:
    """An engine with one TPDO 185h (if `names` are given), in OPERATIONAL since T."""

    def __init__(self, bench: Bench, *names: str, **parameters: Any) -> None:
        self.bench = bench
        self.engine = TransmitEngine(bench.cell, bench.send)
        if names:
            self.engine.configure(1, bench.configuration(names, **parameters))
        self.engine.nmt(operational=True, now=T)

    def take(self) -> list[str]:
        return self.bench.take()  # type: ignore[no-any-return]  # see Bench

    def show(self, after: float, **values: Any) -> list[str]:
        self.bench.show(**values)
        self.engine.image_changed(T + after)
        return self.take()

    def tick(self, after: float) -> list[str]:
        self.engine.tick(T + after)
        return self.take()

    def sync(self, counter: int | None = None, after: float = 0.0) -> list[str]:
        self.engine.on_sync(counter, T + after)
        return self.take()

    def wake_ups(self, until: float) -> list[float]:
        """When frames leave by time alone, as a loop that keeps the deadlines would see it."""
        times = []
        while (deadline := self.engine.next_deadline()) <= T + until:
            if self.tick(deadline - T):
                times.append(round(deadline - T, 6))
        return times


def int_frame(value: int, can_id: str = "185") -> list[str]:
    return [f"{can_id}:{value.to_bytes(4, 'little', signed=True).hex()}"]


# -- event-driven ------------------------------------------------------------------------------------------------

EVENT_DRIVEN = pytest.mark.parametrize("transmission", [254, 255])


@EVENT_DRIVEN
def test_event_driven_pdo_is_sent_when_operational_is_entered(bench: Bench, transmission: int) -> None:
    bench.show(out_int_0=7)
    sender = Sender(bench, "out_int_0", transmission=transmission)
    assert sender.take() == int_frame(7)


@EVENT_DRIVEN
def test_pdo_19_20_event_driven_pdo_is_sent_when_its_content_changes(bench: Bench, transmission: int) -> None:
    sender = Sender(bench, "out_int_0", transmission=transmission)
    sender.take()
    assert sender.show(0.1) == []
    assert sender.show(0.2, out_int_1=3) == []
    assert sender.show(0.3, out_int_0=3) == int_frame(3)
    assert sender.show(0.4) == []
    assert sender.sync(1) == []


def test_nothing_is_sent_outside_operational(bench: Bench) -> None:
    sender = Sender(bench, "out_int_0", event=0.1)
    sender.take()
    sender.engine.nmt(operational=False, now=T)
    assert sender.engine.next_deadline() == math.inf
    assert sender.show(0.1, out_int_0=3) == []
    assert sender.tick(5) == []
    assert sender.sync() == []
    sender.engine.nmt(operational=True, now=T + 6)
    assert sender.take() == int_frame(3)


def test_all_variables_of_a_frame_are_of_one_moment(bench: Bench) -> None:
    sender = Sender(bench, "out_int_0", "out_int_1", inhibit=0.1)
    sender.take()
    sender.show(0.01, out_int_0=1, out_int_1=1)
    sender.show(0.02, out_int_0=2, out_int_1=2)
    assert sender.tick(0.1) == ["185:0200000002000000"]


def test_inhibit_time_holds_changes_back_and_sends_the_newest(bench: Bench) -> None:
    sender = Sender(bench, "out_int_0", inhibit=0.1)
    assert sender.take() == int_frame(0)
    assert sender.show(0.02, out_int_0=1) == []
    assert sender.engine.next_deadline() == T + 0.1
    assert sender.show(0.05, out_int_0=2) == []
    assert sender.tick(0.0999) == []
    assert sender.tick(0.1) == int_frame(2)
    assert sender.engine.next_deadline() == math.inf
    assert sender.show(0.15, out_int_0=3) == []
    assert sender.tick(0.2) == int_frame(3)
    assert sender.show(0.9, out_int_0=4) == int_frame(4)


def test_change_that_is_undone_within_the_inhibit_time_is_not_sent(bench: Bench) -> None:
    sender = Sender(bench, "out_int_0", inhibit=0.1)
    sender.take()
    sender.show(0.02, out_int_0=1)
    sender.show(0.03, out_int_0=0)
    assert sender.tick(0.1) == []
    assert sender.show(0.2, out_int_0=5) == int_frame(5)


def test_event_timer_sends_what_has_not_changed(bench: Bench) -> None:
    sender = Sender(bench, "out_int_0", event=0.1)
    sender.take()
    assert sender.tick(0.099) == []
    assert sender.tick(0.1) == int_frame(0)
    assert sender.show(0.15, out_int_0=1) == int_frame(1)
    assert sender.tick(0.2) == [], "a transmission starts the event timer anew"
    assert sender.tick(0.25) == int_frame(1)


def test_late_ticks_do_not_add_up(bench: Bench) -> None:
    sender = Sender(bench, "out_int_0", event=0.1)
    sender.take()
    assert sender.tick(0.13) == int_frame(0)
    assert sender.tick(0.2) == int_frame(0)
    assert sender.tick(0.55) == int_frame(0), "what was missed is not made up for"
    assert sender.tick(0.6) == []
    assert sender.wake_ups(0.9) == [0.65, 0.75, 0.85]


def test_event_timer_shorter_than_the_inhibit_time_waits_for_it(bench: Bench) -> None:
    sender = Sender(bench, "out_int_0", inhibit=0.1, event=0.03)
    sender.take()
    assert sender.wake_ups(0.35) == [0.1, 0.2, 0.3]


@pytest.mark.parametrize("transmission", [0, 1, 240])
def test_event_timer_and_inhibit_time_are_for_event_driven_pdos(bench: Bench, transmission: int) -> None:
    sender = Sender(bench, "out_int_0", transmission=transmission, inhibit=1.0, event=0.1)
    assert sender.engine.next_deadline() == math.inf
    assert sender.tick(5) == []
    if transmission == 1:
        assert sender.sync() == sender.sync() == int_frame(0)


# -- what counts as a change -------------------------------------------------------------------------------------


def test_deadband_counts_from_what_was_sent_last(new_bench: Any) -> None:
    sender = Sender(new_bench(out_real_0={"deadband": 0.5}), "out_real_0")
    sender.take()
    assert sender.show(0.1, out_real_0=0.3) == []
    assert sender.show(0.2, out_real_0=0.49) == []
    assert sender.show(0.3, out_real_0=0.5) == [f"185:{struct.pack('<d', 0.5).hex()}"]
    assert sender.show(0.4, out_real_0=0.9) == []
    assert sender.show(0.5, out_real_0=0.0) == [f"185:{bytes(8).hex()}"]


def test_a_move_by_exactly_the_deadband_is_sent(new_bench: Any) -> None:
    """In decimal: 0.3 - 0.2 is less than 0.1 for a processor."""
    sender = Sender(new_bench(out_real_0={"deadband": 0.1}), "out_real_0")
    sender.take()
    assert [len(sender.show(0.1 * n, out_real_0=n / 10)) for n in range(1, 8)] == [1] * 7
    assert sender.show(1.0, out_real_0=0.7999) == []


def test_variable_without_a_deadband_beside_one_with(new_bench: Any) -> None:
    sender = Sender(new_bench(out_single_0={"deadband": 0.5}), "out_single_0", "out_int_0")
    sender.take()
    assert sender.show(0.1, out_single_0=0.25) == []
    assert sender.show(0.2, out_int_0=1) == ["185:0000803e01000000"]


def test_deadband_holds_after_the_inhibit_time_too(new_bench: Any) -> None:
    sender = Sender(new_bench(out_real_0={"deadband": 0.5}), "out_real_0", inhibit=0.1)
    sender.take()
    sender.show(0.02, out_real_0=0.2)
    assert sender.tick(0.1) == []
    assert len(sender.show(0.2, out_real_0=0.7)) == 1


@pytest.mark.parametrize("deadband", [0.0, 0.5])
def test_becoming_nan_or_infinite_is_a_change_and_staying_so_is_none(new_bench: Any, deadband: float) -> None:
    sender = Sender(new_bench(out_real_0={"deadband": deadband}), "out_real_0")
    sender.take()
    for value in (math.nan, math.inf, -math.inf, math.nan, 0.0):
        assert len(sender.show(0.1, out_real_0=value)) == 1
        assert sender.show(0.2, out_real_0=float(str(value))) == []


def test_change_that_the_type_on_the_bus_cannot_tell_is_none(bench: Bench) -> None:
    sender = Sender(bench, "out_single_0")
    sender.show(0.1, out_single_0=1.0)
    assert sender.show(0.2, out_single_0=1.0 + 1e-12) == []
    assert len(sender.show(0.3, out_single_0=1.5)) == 1


# -- synchronous -------------------------------------------------------------------------------------------------


def test_pdo_03_acyclic_pdo_is_sent_with_the_sync_after_a_change(bench: Bench) -> None:
    sender = Sender(bench, "out_int_0", transmission=0)
    assert sender.take() == []
    assert sender.sync() == int_frame(0), "the first SYNC sends what there is"
    assert sender.sync() == []
    assert sender.show(0.1, out_int_0=1) == []
    assert sender.sync() == int_frame(1)
    assert sender.sync() == []


@pytest.mark.parametrize("transmission", [1, 2, 3, 10, 239, 240])
def test_pdo_05_18_cyclic_pdo_is_sent_with_every_nth_sync(bench: Bench, transmission: int) -> None:
    sender = Sender(bench, "out_int_0", transmission=transmission)
    assert sender.show(0.1, out_int_0=1) == []
    sent = [bool(sender.sync()) for _ in range(3 * transmission)]
    assert [position for position, one in enumerate(sent) if one] == [0, transmission, 2 * transmission]


def test_cyclic_pdo_holds_the_values_of_the_moment_of_sync(bench: Bench) -> None:
    sender = Sender(bench, "out_int_0", transmission=2)
    sender.sync()
    sender.show(0.1, out_int_0=1)
    assert sender.sync() == []
    bench.show(out_int_0=2)
    assert sender.sync() == int_frame(2)


def test_counting_begins_anew_with_operational(bench: Bench) -> None:
    sender = Sender(bench, "out_int_0", transmission=3)
    assert [bool(sender.sync()) for _ in range(2)] == [True, False]
    sender.engine.nmt(operational=False, now=T)
    sender.engine.nmt(operational=True, now=T)
    assert [bool(sender.sync()) for _ in range(4)] == [True, False, False, True]


def test_sync_start_value_makes_that_counter_the_first(bench: Bench) -> None:
    sender = Sender(bench, "out_int_0", transmission=4, sync_start=3)
    counters = [
        counter for counter in [*range(1, 9), *range(1, 9)] for frames in [sender.sync(counter)] if frames
    ]
    assert counters == [3, 7, 3, 7]


@pytest.mark.parametrize("counter", [None, 0])
def test_sync_start_value_means_nothing_without_a_counter(bench: Bench, counter: int | None) -> None:
    sender = Sender(bench, "out_int_0", transmission=2, sync_start=3)
    assert [bool(sender.sync(counter)) for _ in range(3)] == [True, False, True]


def test_sync_start_value_means_nothing_for_acyclic_pdos(bench: Bench) -> None:
    sender = Sender(bench, "out_int_0", transmission=0, sync_start=3)
    assert sender.sync(1) == int_frame(0)


# -- variables that may not be read ------------------------------------------------------------------------------


@pytest.fixture
def guarded(guarded_bench: Bench) -> Bench:
    return guarded_bench


def test_pdo_stops_while_its_variable_may_not_be_read(guarded: Bench) -> None:
    sender = Sender(guarded, "out_int_0", event=0.1)
    sender.engine.configure(2, guarded.configuration(["out_int_1"], number=2, can_id=0x285))
    sender.tick(0)
    guarded.cell.robot_lost("cut", T)
    assert sender.show(0.01, out_int_0=1, out_int_1=2) == int_frame(2, "285")
    assert sender.tick(3) == []
    assert sender.engine.next_deadline() == math.inf
    assert [pdo.is_stopped for pdo in sender.engine.pdos] == [True, False]
    guarded.cell.robot_connected(T + 4)
    guarded.cell.package_arrived(1005.0, T + 4)
    assert sender.show(4, out_int_0=1) == [], "the package was not copied yet"
    guarded.cell.outputs_written(T + 4)
    assert sender.show(4) == int_frame(1), "it starts again with what there is"
    assert sender.wake_ups(4.25) == [4.1, 4.2]


@pytest.mark.parametrize("transmission", [0, 1])
def test_synchronous_pdo_stops_and_resumes_too(guarded: Bench, transmission: int) -> None:
    sender = Sender(guarded, "out_int_0", transmission=transmission)
    sender.sync()
    guarded.cell.robot_lost("cut", T)
    assert sender.sync() == []
    guarded.cell.robot_connected(T)
    guarded.cell.package_arrived(1001.0, T)
    guarded.cell.outputs_written(T)
    assert sender.sync() == int_frame(0)


def test_pdo_that_is_stopped_from_the_start_sends_nothing(new_bench: Any) -> None:
    bench = new_bench(out_int_0={"on_stale": Fallback(FallbackKind.EXCEPTION)})
    bench.cell.robot_lost("cut", T)
    sender = Sender(bench, "out_int_0")
    for after in range(5):
        assert sender.tick(after) == []
    sender.engine.nmt(operational=False, now=T + 6)
    sender.engine.nmt(operational=True, now=T + 7)
    assert sender.take() == []


# -- configured while they run -----------------------------------------------------------------------------------


def test_pdo_that_becomes_valid_is_sent_with_the_next_tick(bench: Bench) -> None:
    sender = Sender(bench)
    assert sender.engine.next_deadline(T) == math.inf
    sender.engine.configure(3, bench.configuration(["out_int_0"], number=3, can_id=0x385))
    assert sender.engine.next_deadline(T) == T
    assert sender.tick(0) == int_frame(0, "385")
    assert sender.engine.next_deadline(T) == math.inf


def test_pdo_that_becomes_invalid_is_silent(bench: Bench) -> None:
    sender = Sender(bench, "out_int_0", event=0.1, inhibit=0.05)
    sender.take()
    sender.show(0.01, out_int_0=1)
    sender.engine.configure(1, None)
    assert sender.tick(1) == []
    assert sender.show(1, out_int_0=2) == []
    assert sender.engine.pdos == ()


def test_inhibit_time_goes_on_over_a_change_of_parameters(bench: Bench) -> None:
    sender = Sender(bench, "out_int_0", inhibit=0.1)
    sender.take()
    sender.engine.configure(1, bench.configuration(["out_int_0"], inhibit=0.1, event=1.0))
    assert sender.tick(0.01) == []
    assert sender.tick(0.1) == int_frame(0)


def test_transmission_type_can_change_while_operational(bench: Bench) -> None:
    sender = Sender(bench, "out_int_0")
    sender.take()
    sender.engine.configure(1, bench.configuration(["out_int_0"], transmission=1))
    assert sender.show(0.1, out_int_0=1) == []
    assert sender.sync() == int_frame(1)


def test_every_schedule_starts_and_no_row_is_for_a_schedule_that_sync_cannot_reach() -> None:
    assert {schedule for schedule, signal in MOVES if signal is TransmitSignal.START} == set(Schedule)
    assert (Schedule.EVENT, TransmitSignal.SYNC) not in MOVES

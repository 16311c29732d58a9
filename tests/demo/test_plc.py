"""The PLC program: its handshake, its checks, and its scan over a real connection."""

from __future__ import annotations

import pytest

from gatewayd.demo.plc import FORCE_SHARE, TRANSITIONS, Answers, Order, Phase, Program, Signal

READY = Answers(alive=True)
LOST = Answers(alive=False)


def busy(order: Order) -> Answers:
    return Answers(True, busy=True, part_done=order.part_number)


def done(order: Order, cycles: int = 1) -> Answers:
    return Answers(True, False, True, order.part_number, cycles, order.force_limit * FORCE_SHARE)


def test_handshake_counts_when_the_robot_is_ready_again() -> None:
    program = Program()
    order = program.scan(READY)
    assert order.start
    assert order.words == [1, 101, 400]
    assert program.scan(busy(order)) == order
    assert not program.scan(done(order)).start
    assert (program.handshakes, program.verified, program.wrong) == (0, 3, [])
    program.scan(READY)
    assert program.handshakes == 1
    assert program.scan(READY).words == [1, 102, 475]


def test_every_tenth_part_is_fed_slowly() -> None:
    program = Program()
    slow = []
    for cycles in range(13):
        order = program.scan(READY)
        program.scan(busy(order))
        program.scan(done(order, cycles))
        slow.append(order.slow)
        program.scan(READY)
    assert [number for number, is_slow in enumerate(slow) if is_slow] == [2, 12]


def test_answers_that_differ_are_told() -> None:
    program = Program()
    order = program.scan(READY)
    program.scan(busy(order))
    program.scan(done(order, cycles=2))
    assert program.verified == 2
    assert program.wrong == ["cycles is 2, expected 1"]


def test_a_robot_that_is_done_before_it_was_asked_is_waited_for() -> None:
    program = Program()
    assert not program.scan(done(Order())).start
    assert program.phase is Phase.WAITING


@pytest.mark.parametrize("phase", Phase)
def test_lost_robot_takes_start_back(phase: Phase) -> None:
    program = Program(phase=phase, order=Order(start=phase is not Phase.WAITING))
    assert not program.scan(LOST).start
    assert program.phase is Phase.WAITING
    assert program.handshakes == 0


def test_every_phase_has_a_way_on() -> None:
    for phase in Phase:
        assert {after for (before, _), after in TRANSITIONS.items() if before is phase} - {phase}
    assert {signal for _, signal in TRANSITIONS} == set(Signal)

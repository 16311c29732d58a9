from __future__ import annotations

import pytest

from gatewayd.rtde.lists import ListMemory, ListOutcome
from gatewayd.rtde.messages import ControllerVersion

OLD, NEW = ControllerVersion(3, 4, 0, 1), ControllerVersion(5, 12, 0, 1)
FAILED = ListOutcome(OLD, took_long=False, failed_at_long=True, complained=False)
ELSEWHERE = ListOutcome(None, took_long=False, failed_at_long=False, complained=False)
SHORT = ListOutcome(OLD, took_long=False, failed_at_long=False, complained=False)


def after(*outcomes: tuple[ListOutcome, bool]) -> ListMemory:
    memory = ListMemory()
    for outcome, started in outcomes:
        memory.learn(outcome, started=started)
    return memory


def test_one_lost_connection_states_nothing() -> None:
    assert not after((FAILED, False)).limited


@pytest.mark.parametrize(
    "between", [[], [(ELSEWHERE, False)]], ids=["in a row", "with a refused one between"]
)
def test_two_failures_at_a_long_list_lead_to_short_ones(between: list[tuple[ListOutcome, bool]]) -> None:
    assert after((FAILED, False), *between, (FAILED, False)).limited


def test_a_list_that_is_taken_ends_the_suspicion() -> None:
    assert not after((FAILED, False), (SHORT._replace(took_long=True), True), (FAILED, False)).limited


def test_failures_alone_are_put_to_the_test_again_after_a_session() -> None:
    """A controller that is silent costs one failure then; one that was only slow is verified in full again."""
    memory = after((FAILED, False), (FAILED, False), (SHORT, True))
    assert not memory.limited
    memory.learn(FAILED, started=False)
    assert memory.limited


def test_a_complaint_is_a_statement_and_remembered_for_that_software() -> None:
    memory = after((FAILED._replace(complained=True), False), (SHORT, True), (SHORT, True))
    assert memory.limited
    memory.learn(ELSEWHERE, started=False)
    assert memory.limited
    memory.learn(SHORT._replace(controller=NEW), started=True)
    assert not memory.limited

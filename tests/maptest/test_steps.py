"""What a failure says, and where."""

from __future__ import annotations

import pytest

from gatewayd.core.image import Quality
from gatewayd.core.program import STATES
from gatewayd.core.refusal import Reason
from gatewayd.mapping.document import MappingTest
from gatewayd.mapping.testing import StepSpec
from tests.maptest.written import MAPPING, failures, outcome

FAILING = {
    "value": (["{by: plc, write: {speed: 50}}", "{after: 1s, expect: {speed: 0}}"],
              "expected speed 0, is 50 (owner plc since 0 s)", "its lease at 5 s or its time-out at 2 s"),
    "bit": (["{expect: {start: true}}"], "expected start true, is false (nobody has owned it)", "`on_release`: clear"),
    "released": (["{by: plc, write: {start: true}}", "{after: 3s, expect: {start: true}}"],
                 "expected start true, is false (free since 2.02 s: owner lost: no request for 2 s)", "`alive: plc`"),
    "endless": (["{by: panel, write: {light: true}}", "{expect: {light: false}}"],
                "expected light false, is true (owner panel since 0 s)", "neither a `lease` nor a `timeout`"),
    "owner": (["{by: plc, take: speed, owner: {speed: hmi}}"],
              "expected the owner of speed to be hmi, is plc (owner plc since 0 s)", "its lease at 5 s"),
    "operator": (["{by: operator, take: speed, owner: {speed: free}}"],
                 "expected the owner of speed to be free, is operator (owner operator since 0 s)", "nothing ends"),
    "output": (["{robot: lost, expect: {force: 0}}"],
               "expected force 0, is -1 (quality stale, the robot is not connected)", "`on_stale`: -1"),
    "quality": (["{robot: silent, quality: {force: stale}}"],
                "expected the quality of force to be stale, is good (the robot reports)", "0.2 s"),
    "unavailable": (["{unavailable: force, quality: {force: good}}"],
                    "expected the quality of force to be good, is unavailable (another client has its register)", ""),
    "refused": (["{by: plc, write: {speed: 500}}"],
                "the request was refused: value out of limits: speed (limits 0..100)", "`refused: out_of_limits`"),
    "out of type": (["{by: plc, write: {part: 3000000000}}"],
                    "the request was refused: value out of limits: part (whole numbers -2147483648..2147483647)", ""),
    "held": (["{by: plc, write: {speed: 5}}", "{by: hmi, take: speed}"],
             "the request was refused: held by another owner: speed (owner plc since 0 s)", "`refused: held`"),
    "accepted": (["{by: plc, write: {speed: 5}, refused: held}"],
                 "expected the request to be refused (held), but it was accepted", "after it: owner plc since 0 s"),
    "other reason": (["{by: hmi, write: {start: true}, refused: held}"],
                     ("expected the request to be refused (held), but it was for another reason: "
                      "never writable by this writer: start"), "`refused: not_writable`"),
    "release of what nobody owns": (["{by: plc, release: speed, refused: held}"],
                                    "expected the request to be refused (held), but it was accepted", "nobody"),
}  # fmt: skip


@pytest.mark.parametrize("steps,message,hint", FAILING.values(), ids=FAILING)
def test_says_what_is_and_why(steps: list[str], message: str, hint: str) -> None:
    (one,) = outcome(*steps).outcomes
    (failure,) = one.failures
    assert failure.message == message
    assert hint in failure.hint
    assert failure.step == len(steps)


def test_is_at_the_value_that_was_expected() -> None:
    """Line and column of the value, so that an editor jumps to what is to be corrected."""
    (one,) = outcome("{by: plc, write: {start: true}}", "{expect: {start: false, speed: 1}}").outcomes
    line = MAPPING.count("\n") + 4
    step = "     - {expect: {start: false, speed: 1}}"
    found = [(failure.position.line, failure.position.column) for failure in one.failures]
    assert found == [(line, step.index("false")), (line, step.index("1}"))]


def test_reals_need_not_agree_to_the_last_digit() -> None:
    assert failures("{robot: {force: 0.30000000000000004}, expect: {force: 0.3}}") == []
    assert failures("{robot: {force: 0.3001}, expect: {force: 0.3}}") != []


def words(key: str) -> set[str]:
    """What may stand under a key of a step: the core's words, which the language says again."""
    step = StepSpec.model_fields[key]
    return set(step.annotation.__args__[0].__args__)


def test_words_are_those_of_the_core() -> None:
    """Reasons that only a bus can cause are none of a test's."""
    of_a_bus = {"no_such_address", "partial_value", "waited", "not_meant", "not_in_role", "contradicted"}
    assert words("refused") | of_a_bus == {reason.name.lower() for reason in Reason}
    qualities = StepSpec.model_fields["quality"].annotation.__args__[0].__args__[1].__args__
    assert set(qualities) == {quality.name.lower() for quality in Quality}
    assert words("program") == {name for name, _running in STATES.values()}


def test_nothing_is_carried_out_behind_a_failure() -> None:
    (one,) = outcome("{expect: {start: true}}", "{after: 1h}").outcomes
    assert isinstance(one.test, MappingTest)
    assert (one.passed, one.seconds, len(one.failures)) == (False, 0.0, 1)

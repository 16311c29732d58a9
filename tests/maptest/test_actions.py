"""Everything that can happen in a step, as the core takes it."""

from __future__ import annotations

import pytest

from gatewayd.maptest.actions import CellNames
from tests.maptest.written import failures, plant

PASSING = {
    "a write by the only owner": ["{by: plc, write: {start: true}, expect: {start: true}, owner: {start: plc}}"],
    "a write of an integer to a real": ["{by: plc, write: {speed: 50}, expect: {speed: 50}}"],
    "several in one request": ["{by: plc, write: {start: true, speed: 7.5}, expect: {start: true, speed: 7.5}}"],
    "a refused request changes nothing": [
        "{by: plc, write: {start: true, speed: 700}, refused: out_of_limits}",
        "{expect: {start: false, speed: 0}, owner: {start: free}}",
    ],
    "clamped": ["{by: plc, write: {clamp: 5}, expect: {clamp: 1}}"],
    "a fraction for an integer": ["{by: plc, write: {part: 70000000000}, refused: out_of_limits}"],
    "held": ["{by: plc, write: {speed: 1}}", "{by: hmi, write: {speed: 2}, refused: held, expect: {speed: 1}}"],
    "taken over": ["{by: hmi, write: {speed: 1}}", "{by: plc, write: {speed: 2}, owner: {speed: plc}}"],
    "never writable": ["{by: hmi, write: {start: true}, refused: not_writable}"],
    "an output": ["{by: plc, write: {cycles: 1}, refused: not_writable}"],
    "a member of a family": ["{by: plc, write: {'recipe[2]': 4}, expect: {'recipe[2]': 4, 'recipe[1]': 0}}"],
    "lease over": [
        "{by: plc, write: {speed: 9}}",
        "{after: 4.9s, alive: plc, owner: {speed: plc}}",
        "{after: 200ms, alive: plc, owner: {speed: free}, expect: {speed: 0}}",
    ],
    "lease renewed by writing": ["{by: plc, write: {speed: 9}, repeat_for: 20s, owner: {speed: plc}}"],
    "silent writer": [
        "{by: plc, write: {start: true}}", "{after: 1.9s, owner: {start: plc}}",
        "{after: 200ms, owner: {start: free}, expect: {start: false}}",
    ],
    "reading keeps it alive": ["{by: plc, write: {start: true}}", "{after: 1min, alive: plc, owner: {start: plc}}"],
    "held value": ["{by: plc, write: {part: 4}}", "{after: 10s, expect: {part: 4}, owner: {part: free}}"],
    "connection lost": ["{by: plc, write: {start: true}}", "{lost: plc, expect: {start: false}}"],
    "grace": [
        "{by: hmi, write: {speed: 5}}", "{lost: hmi, owner: {speed: hmi}}", "{after: 500ms, owner: {speed: hmi}}",
        "{after: 600ms, owner: {speed: free}}",
    ],
    "back within its grace": [
        "{by: hmi, write: {speed: 5}}", "{lost: hmi}", "{connected: hmi}",
        "{by: hmi, write: {speed: 6}}", "{after: 1.5s, owner: {speed: hmi}}",
    ],
    "lost without having come": ["{lost: [plc, hmi, line], owner: {start: free}}"],
    "a lost heartbeat": [
        "{by: line, write: {belt: 2}}", "{lost: line, expect: {belt: 0}, owner: {belt: free}}",
        "{by: line, write: {belt: 2}, refused: heartbeat_lost}", "{connected: line}",
        "{by: line, write: {belt: 2}, expect: {belt: 2}}",
    ],
    "take and release": [
        "{by: plc, take: speed, owner: {speed: plc}}", "{by: hmi, take: speed, refused: held}",
        "{by: hmi, release: speed, refused: held}", "{by: plc, release: speed, owner: {speed: free}}",
    ],
    "a group": [
        "{by: hmi, take: motion, owner: {go: hmi, target: hmi}}",
        "{by: plc, write: {go: true}, refused: partial_takeover}",
        "{by: plc, write: {go: true, target: 4}, owner: {go: plc}}",
        "{after: 1.6s, alive: plc, owner: {target: free}, expect: {go: false, target: 0}}",
    ],
    "two who wait for each other": [
        "{by: hmi, write: {part: 1}}", "{by: plc, write: {part: 2}, refused: held}",
        "{after: 3.1s, alive: hmi}", "{by: plc, write: {part: 2}, owner: {part: plc}}",
    ],
    "the operator takes": [
        "{by: operator, take: [speed, motion], owner: {speed: operator, go: operator}}",
        "{by: plc, write: {speed: 1}, refused: held}", "{by: operator, release: speed, owner: {speed: free}}",
    ],
    "the operator frees a writer's": ["{by: plc, take: start}", "{by: operator, release: start, owner: {start: free}}"],
    "forced input": [
        "{force: {speed: 50}, expect: {speed: 50}, quality: {speed: forced}, owner: {speed: operator}}",
        "{by: plc, write: {speed: 1}, refused: held}", "{unforce: speed, expect: {speed: 0}, quality: {speed: good}}",
    ],
    "forced output": [
        "{force: {cycles: 5}, quality: {cycles: forced}}", "{robot: {cycles: 8}, expect: {cycles: 5}}",
        "{unforce: cycles, expect: {cycles: 8}}",
    ],
    "force out of limits": ["{force: {speed: 500}, refused: out_of_limits}"],
    "the robot shows": ["{robot: {cycles: 5, force: 1.5}, expect: {cycles: 5, force: 1.5}, quality: {force: good}}"],
    "robot lost": [
        "{robot: {cycles: 5, force: 1.5}}", "{robot: lost, expect: {cycles: 5, force: -1}, quality: {cycles: stale}}",
        "{by: plc, write: {start: true}, refused: robot_lost}", "{robot: connected, expect: {force: 1.5}}",
    ],
    "robot silent": [
        "{robot: {force: 1.5}}", "{robot: silent, quality: {force: good}}", "{after: 100ms, expect: {force: 1.5}}",
        "{after: 200ms, expect: {force: -1}, quality: {force: stale}}", "{robot: connected, quality: {force: good}}",
    ],
    "what was due reaches the robot later": [
        "{by: plc, write: {start: true}}", "{robot: lost}", "{lost: plc}", "{robot: connected, expect: {start: false}}",
    ],
    "the robot keeps what it holds": [
        "{by: plc, write: {start: true}}", "{robot: lost}", "{robot: connected, expect: {start: true}}",
    ],
    "a restarted robot holds nothing": [
        "{by: plc, write: {start: true}}", "{robot: {cycles: 4}}",
        "{robot: restarted, expect: {start: false, cycles: 0, state: 1}}",
    ],
    "what nobody claims falls back": [
        "{expect: {light: false}}", "{after: 4.9s, expect: {light: false}}", "{after: 200ms, expect: {light: true}}",
    ],
    "the program stops": [
        "{robot: {busy: true}, expect: {busy: true}}",
        "{program: stopped, expect: {busy: false, state: 1}, quality: {busy: not_running}}",
        "{program: playing, expect: {busy: true}}",
    ],
    "the program stops, as the robot shows it": ["{robot: {state: 1}, quality: {busy: not_running}}"],
    "a register of somebody else": [
        "{by: plc, write: {start: true}}", "{unavailable: start, quality: {start: unavailable, speed: good}}",
        "{by: plc, write: {start: false}, refused: claimed_elsewhere}",
        "{available: start, quality: {start: good}}", "{by: plc, write: {start: true}, expect: {start: true}}",
    ],
    "a field that the controller does not have": [
        "{robot: {force: 2}}", "{unavailable: force, quality: {force: unavailable}, expect: {force: -1}}",
        "{available: force, quality: {force: good}, expect: {force: 2}}",
    ],
}  # fmt: skip


@pytest.mark.parametrize("steps", PASSING.values(), ids=PASSING)
def test_the_core_does_so(steps: list[str]) -> None:
    assert failures(*steps) == []


def test_a_repeated_write_ends_with_the_first_answer_that_is_not_expected() -> None:
    """Another writer's lease ends within the time, so what was refused is not any more."""
    (failure,) = failures(
        "{by: plc, write: {part: 1}}", "{by: hmi, write: {part: 2}, repeat_for: 5s, refused: held}"
    )
    assert failure == "expected the request to be refused (held), but it was accepted"


def test_names_of_groups_stand_for_their_lock() -> None:
    names = CellNames(plant().cell.definition)
    assert names.locks(["motion"]) == names.locks(["go", "target"])
    assert names.values({"recipe[1]": 4}) == {names.variables["recipe[1]"]: 4}

"""What two mappings differ in, told for people and programs, and what of it is refused while something is owned."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import pytest

from gatewayd.core.objection import Objection, ObjectionKind
from gatewayd.mapping.loader import load
from gatewayd.mapping.plan import Plan
from gatewayd.report.diff import ChangeKind, Changes, as_json, as_text, compare, objections

GOLDEN = Path(__file__).parents[1] / "golden" / "diff.txt"

OLD = """\
gatewayd: 1
cell: press
robot: {host: 127.0.0.1, frequency: 250, series: e}
modbus: {listen: '127.0.0.1:1502'}
writers:
  plc: {modbus: 127.0.0.2, timeout: 1s}
  hmi: {modbus: 127.0.0.3}
groups:
  motion: {owner: [plc, hmi], lease: 2s}
variables:
  start:  {robot: input_bit_register_0, modbus: 0.0, owner: plc}
  part:
    {robot: input_int_register_0, modbus: {holding: 10, type: uint16}, owner: [plc, hmi], lease: 2s, on_release: hold}
  force:
    {robot: input_double_register_0, modbus: {holding: 20, type: int16, scale: 0.1}, limits: [0, 150], clamp: true,
     unit: N}
  speed:  {robot: input_double_register_1, modbus: 24, group: motion, limits: [0, 1]}
  cycles: {robot: output_int_register_0, modbus: 100, on_stale: hold}
  recipe: {robot: output_double_register_0..7, modbus: 200}
"""
NEW = """\
gatewayd: 1
cell: press
robot: {host: 127.0.0.1, frequency: 500, series: e}
modbus: {listen: '127.0.0.1:1503', gaps: zero}
writers:
  plc: {modbus: 127.0.0.2, timeout: 2s}
  line: {modbus: 127.0.0.4}
groups:
  motion: {owner: [plc, line], lease: 3s}
variables:
  start:  {robot: input_bit_register_0, modbus: 0.0, owner: [plc, line]}
  force:
    {robot: input_double_register_0, modbus: {holding: 22, type: int16, scale: 0.1}, limits: [0, 100], clamp: true,
     unit: N, comment: less}
  speed:  {robot: input_double_register_1, modbus: 24, group: motion, limits: [0, 1]}
  cycles: {robot: output_int_register_0, modbus: {holding: 100, order: CDAB}, on_stale: 7}
  recipe: {robot: output_double_register_0..3, modbus: 200}
  counts: {robot: output_int_register_4..7, modbus: [300, {input: 10}]}
  door:   {robot: actual_digital_input_bits.3, modbus: {discrete: 64}}
"""


@cache
def plan(text: str) -> Plan:
    loaded = load(text.encode(), "cell.yaml")
    assert loaded.plan is not None, loaded.diagnostics
    return loaded.plan


def changed(*replacements: tuple[str, str], of: str = OLD) -> Changes:
    text = of
    for old, new in replacements:
        assert old in text
        text = text.replace(old, new)
    return compare(plan(of), plan(text))


def test_text_is_the_golden_one() -> None:
    text = as_text(compare(plan(OLD), plan(NEW)))
    assert text == GOLDEN.read_text(), f"if this is meant: write it to {GOLDEN}\n{text}"


def test_a_mapping_does_not_differ_from_itself() -> None:
    """Nor from one that is spelled otherwise."""
    changes = changed(("[0, 150]", "[0.0, 150.0]"), ("modbus: 0.0,", "modbus: {holding: 0.0},"))
    assert not changes
    assert as_text(changes) == "press: no difference\n"


SETTINGS = {
    "host": ("host: 127.0.0.1", "host: 127.0.0.9"),
    "port": ("host: 127.0.0.1,", "host: 127.0.0.1, port: 30005,"),
    "frequency": ("frequency: 250", "frequency: 125"),
    "stale_after": ("series: e", "series: e, stale_after: 1s"),
    "on_connect": ("series: e", "series: e, on_connect: fallback"),
    "verify": ("series: e", "series: e, verify: false"),
    "watchdog": (
        "series: e",
        "series: e, watchdog: {field: input_int_register_23, frequency: 10, requires: plc}",
    ),
    "listen": ("127.0.0.1:1502", "127.0.0.1:1503"),
    "unit": ("1502'", "1502', unit: 2"),
    "allow": ("1502'", "1502', allow: [127.0.0.0/8]"),
    "connections": ("1502'", "1502', connections: 5"),
    "idle_timeout": ("1502'", "1502', idle_timeout: 61s"),
    "connections_per_peer": ("1502'", "1502', connections_per_peer: 5"),
    "default_unit": ("1502'", "1502', default_unit: true"),
    "gaps": ("1502'", "1502', gaps: zero"),
    "write_gaps": ("1502'", "1502', write_gaps: ignore"),
    "robot_away": ("1502'", "1502', robot_away: busy"),
}


@pytest.mark.parametrize("what", SETTINGS)
def test_every_setting_of_a_link_is_told(what: str) -> None:
    changes = changed(SETTINGS[what])
    (link,) = changes.links
    assert [detail.what for detail in link.details] == [what]
    assert not changes.variables


FACTS = {
    "direction": (
        "cycles: {robot: output_int_register_0, modbus: 100, on_stale: hold}",
        "cycles: {robot: input_int_register_5, modbus: 100}",
    ),
    "robot": ("robot: output_int_register_0", "robot: output_int_register_9"),
    "type": ("robot: output_int_register_0, modbus: 100", "robot: output_double_register_20, modbus: 100"),
    "modbus": ("modbus: 100", "modbus: {holding: 100, scale: 0.1}"),
    "limits": ("[0, 150]", "[0, 150.0000001]"),
    "owner": ("owner: plc}", "owner: hmi}"),
    "lease": ("owner: plc}", "owner: plc, lease: 1s}"),
    "group": ("owner: plc}", "group: motion}"),
    "on_release": ("on_release: hold", "on_release: 4"),
    "on_stale": ("on_stale: hold", "on_stale: clear"),
    "unit": ("unit: N", "unit: kN"),
    "comment": ("unit: N", "unit: N, comment: x"),
}


@pytest.mark.parametrize("what", FACTS)
def test_every_fact_of_a_variable_is_told(what: str) -> None:
    changes = changed(FACTS[what])
    assert any(one.kind is ChangeKind.CHANGED and one.detail(what) for one in changes.variables)


def test_nothing_that_means_anything_is_missed() -> None:
    """Where the fingerprint is another one, there is a difference, told or not."""
    changes = changed(("unit: N", "unit: kN"))
    assert changes


def test_renumbering_is_told_once() -> None:
    changes = changed(("variables:\n", "variables:\n  first: {robot: output_bit_register_0, modbus: 90.0}\n"))
    assert "renumbers 13 variables, from `start` (1 -> 2)" in as_text(changes)


def test_json_has_what_the_text_has() -> None:
    told = json.loads(as_json(compare(plan(OLD), plan(NEW))))
    assert told["version"] == 1
    assert told["cell"] == "press"
    assert [one["name"] for one in told["links"]] == ["robot", "modbus"]
    force = next(one for one in told["variables"] if one["name"] == "force")
    assert {"what": "limits", "old": "0..150 clamped", "new": "0..100 clamped"} in force["details"]
    assert len(told["variables"]) == 13
    assert told["old"]["fingerprint"] != told["new"]["fingerprint"]


@pytest.mark.parametrize("summary, replacement", [
    ("press: 1 variable changed", ("[0, 150]", "[0, 100]")),
    ("press: 8 variables removed", ("  recipe: {robot: output_double_register_0..7, modbus: 200}\n", "")),
    ("press: settings of robot changed", ("frequency: 250", "frequency: 500")),
    ("press -> stamp: renamed", ("cell: press", "cell: stamp")),
])  # fmt: skip
def test_summary(summary: str, replacement: tuple[str, str]) -> None:
    assert changed(replacement).summary.startswith(summary)


# -- objections ------------------------------------------------------------------------------------------

ADDED = ("variables:\n", "variables:\n  more: {robot: output_int_register_1, modbus: 110}\n")


def test_nothing_is_objected_to_what_touches_nobody() -> None:
    changes = changed(
        ADDED, ("[0, 150]", "[0, 100]"), ("frequency: 250", "frequency: 500"), ("unit: N", "unit: kN")
    )
    assert objections(changes, {"start", "part", "speed"}) == ()


@pytest.mark.parametrize("replacement, owned, said", [
    (("[0, 150]", "[0, 100]"), "force", "`force` is owned now and would change: limits 0..150 clamped -> 0..100"),
    (("owner: [plc, hmi], lease: 2s}", "owner: [plc, hmi], lease: 1s}"), "speed", "`speed` of the group `motion`"),
])  # fmt: skip
def test_what_touches_an_owner_is_objected_to(replacement: tuple[str, str], owned: str, said: str) -> None:
    changes = changed(replacement)
    assert objections(changes, set()) == ()
    (only,) = objections(changes, {owned})
    assert (only.kind, only.text.startswith(said)) == (ObjectionKind.OWNED, True)


def test_a_comment_on_what_is_owned_is_harmless() -> None:
    assert objections(changed(("unit: N", "unit: N, comment: hot")), {"force"}) == ()


def test_one_more_who_may_own_it_too_is_harmless() -> None:
    """`any` grows with every writer; only a list that takes over could take it away."""
    more = ("  hmi: {modbus: 127.0.0.3}\n", "  hmi: {modbus: 127.0.0.3}\n  line: {modbus: 127.0.0.4}\n")
    assert objections(changed(more), {"force"}) == ()
    assert objections(changed(("owner: plc}", "owner: [plc, hmi], lease: 9s}")), {"start"})


def test_a_direction_never_turns_unasked() -> None:
    changes = changed(("cycles: {robot: output_int_register_0, modbus: 100, on_stale: hold}",
                       "cycles: {robot: input_int_register_5, modbus: 100}"))  # fmt: skip
    assert objections(changes, set()) == (
        Objection(ObjectionKind.DIRECTION, "`cycles` would turn from output to input"),
    )


def test_many_variables_gone_look_like_the_wrong_file() -> None:
    """More than 30 %: of 13 variables 3 may go, not 4."""

    def gone(count: int) -> tuple[Objection, ...]:
        return objections(changed(("register_0..7", f"register_0..{7 - count}")), set())

    assert gone(3) == ()
    assert gone(4) == (
        Objection(ObjectionKind.GONE, "4 of 13 variables would be gone: is it the right file?"),
    )


def test_a_number_that_means_another_variable_matters_to_who_asks_by_number() -> None:
    inserted = changed(ADDED)
    assert objections(inserted, set()) == ()
    (only,) = objections(inserted, set(), numbers_used=True)
    assert (only.kind, only.text) == (
        ObjectionKind.NUMBERS,
        "a request for lock 1 would mean `more` instead of `start` (and 12 more)",
    )
    last = "  recipe: {robot: output_double_register_0..7, modbus: 200}\n"
    appended = changed((last, last + "  more: {robot: output_int_register_1, modbus: 110}\n"))
    assert objections(appended, set(), numbers_used=True) == ()
    assert objections(changed((last, "")), set(), numbers_used=True)[0].kind is ObjectionKind.GONE

"""Every rule by its examples: the bad one breaks it and it alone, the good one passes; then the finer points."""

from __future__ import annotations

import re
import time
from collections.abc import Sequence
from contextlib import chdir
from pathlib import Path

import pytest

from gatewayd.core import status_layout as status
from gatewayd.mapping.diagnostics import Diagnostic, Rule, Severity
from gatewayd.mapping.loader import load, load_together
from gatewayd.mapping.rules import bounds, catalogue
from gatewayd.mapping.rules.registry import CELL_CHECKS, PLANT_CHECKS

ROOT = Path(__file__).parents[2]
RULES = catalogue.complete()

HEAD = """\
gatewayd: 1
cell: press-3
robot: {host: 192.0.2.10}
modbus: {listen: '192.0.2.2:1502'}
writers:
  plc: {modbus: 192.0.2.20, timeout: 1s}
  hmi: {modbus: 192.0.2.21, timeout: 1s}
variables:
  keep: {robot: input_bit_register_63, modbus: 999.15, owner: [plc, hmi]}
"""


def examples(rule: Rule, kind: str) -> list[Path]:
    """The files of an example; rules about several cells have `bad.yaml` and `bad-2.yaml`."""
    return sorted(home(rule).glob(f"{kind}*.yaml"), key=lambda path: path.stem)


def home(rule: Rule) -> Path:
    """The folder of a rule."""
    return ROOT.joinpath(*rule.home.split("."), rule.folder)


def check(paths: Sequence[Path]) -> list[Diagnostic]:
    with chdir(paths[0].parent):  # files beside a mapping are found from where it is
        loaded = load_together([(path.name, path.read_bytes()) for path in paths])
    return [finding for one in loaded for finding in one.diagnostics]


def findings(lines: str, head: str = HEAD) -> list[tuple[str, int]]:
    """Rule and line, counted from the first of `lines`, of all that is found."""
    found = load((head + lines).encode(), "cell.yaml").diagnostics
    return [(finding.rule.id, finding.position.line - head.count("\n")) for finding in found]


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.folder)
def test_bad_example_breaks_this_rule(rule: Rule) -> None:
    """One finding of this rule, at the line that the example says, with a hint; of others warnings at most."""
    paths = examples(rule, "bad")
    findings = check(paths)
    assert not [one for one in findings if one.rule is not rule and one.rule.severity is Severity.ERROR]
    found = [finding for finding in findings if finding.rule is rule]
    assert len(found) == 1
    position = found[0].position
    text = next(path for path in paths if path.name == position.file).read_text("utf-8", "replace")
    lines = text.splitlines()
    stated = re.match(rf"# {rule.id} at line (\d+)", lines[0])
    line = int(stated[1]) if stated else next(n for n, t in enumerate(lines, 1) if f"{rule.id} is here" in t)
    assert position.line == line
    assert position.column >= 1
    assert found[0].hint


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.folder)
def test_good_example_passes(rule: Rule) -> None:
    """No error, and not this rule: a rule that comes later may warn of something else."""
    paths = examples(rule, "good")
    assert paths
    found = [one for one in check(paths) if one.rule is rule or one.rule.severity is Severity.ERROR]
    assert [(str(finding.position), finding.message) for finding in found] == []


def test_the_page_is_current() -> None:
    """Run `python -m gatewayd.mapping.rules.catalogue docs/reference` after a change of a rule's words."""
    page = ROOT / "docs" / "reference" / "rules.md"
    assert page.read_text(encoding="utf-8") == catalogue.catalogue(RULES)


def test_every_folder_belongs_to_a_rule() -> None:
    """A renamed rule leaves nothing behind."""
    folders = {path for path in (ROOT / "gatewayd").rglob("GW[0-9]*") if path.is_dir()}
    assert folders == {home(rule) for rule in RULES}


def test_a_rule_says_what_and_why() -> None:
    """Summaries fit a table, reasons are more than the summary."""
    for rule in RULES:
        assert 10 < len(rule.summary) <= 80, rule.id
        assert not rule.summary.endswith("."), rule.id
        assert len(rule.why) > len(rule.summary), rule.id


def test_every_check_has_its_own_rule() -> None:
    """Nothing is entered twice."""
    entered = [rule.id for rule, _ in [*CELL_CHECKS, *PLANT_CHECKS]]
    assert len(entered) == len(set(entered))


def test_bounds_are_those_of_the_status_block() -> None:
    """Said twice, so that a check need not import the running core."""
    assert (bounds.MAX_VARIABLES, bounds.MAX_WRITERS) == (status.MAX_VARIABLES, status.MAX_WRITERS)


def test_related_place_is_the_first_use() -> None:
    """An overlap names the later line and points to the earlier one."""
    text = HEAD + (
        "  a: {robot: output_int_register_0, modbus: 101}\n  b: {robot: output_int_register_1, modbus: 100}\n"
    )
    (found,) = load(text.encode(), "cell.yaml").diagnostics
    base = HEAD.count("\n")
    assert (found.position.line, found.position.column) == (base + 2, 45)
    assert [(item.position.line, item.position.column) for item in found.related] == [(base + 1, 45)]
    assert "100 to 101 (400101 to 400102)" in found.message
    assert found.hint == "the line fits at 103 to 104 (400104 to 400105)"


ROOM = {
    "behind the other": ("a: {robot: output_int_register_0, modbus: 100}", "101", "102 to 103 (400103 to 400104)"),
    "between two others": (
        "a: {robot: output_int_register_0, modbus: [100, 104, 110]}", "101", "102 to 103 (400103 to 400104)",
    ),
    "behind a gap that is too small": (
        "a: {robot: output_int_register_0, modbus: [100, 103, 110]}", "101", "105 to 106 (400106 to 400107)",
    ),
    "nowhere": ("a: {robot: output_int_register_0, modbus: 59998}", "59998", ""),
}  # fmt: skip


@pytest.mark.parametrize("other,address,room", ROOM.values(), ids=ROOM.keys())
def test_the_remedy_of_an_overlap_is_a_place_that_fits(other: str, address: str, room: str) -> None:
    """The next room behind the place that was meant, or none."""
    text = f"{HEAD}  {other}\n  b: {{robot: output_int_register_1, modbus: {address}}}\n"
    (found,) = load(text.encode(), "cell.yaml").diagnostics
    expected = f"the line fits at {room}" if room else "shorten one of the two lines, or use another area"
    assert found.hint == expected


OVERLAPS = {
    "areas count each for itself": (
        (
            "  a: {robot: output_bit_register_0, modbus: {coil: 5}}\n"
            "  b: {robot: output_bit_register_1, modbus: {discrete: 5}}\n"
            "  c: {robot: output_int_register_0, modbus: {holding: 5}}\n"
            "  d: {robot: output_int_register_1, modbus: {input: 5}}\n"
        ),
        [],
    ),
    "bits side by side": (
        "  a: {robot: output_bit_register_0, modbus: 5.0}\n  b: {robot: output_bit_register_1, modbus: 5.1}\n",
        [],
    ),
    "the same bit": (
        "  a: {robot: output_bit_register_0, modbus: 5.3}\n  b: {robot: output_bit_register_1, modbus: 5.3}\n",
        [("GW214", 2)],
    ),
    "the same coil": (
        (
            "  a: {robot: output_bit_register_0, modbus: {coil: 5}}\n"
            "  b: {robot: output_bit_register_1, modbus: {coil: 5}}\n"
        ),
        [("GW214", 2)],
    ),
    "two places of one variable": ("  a: {robot: output_int_register_0, modbus: [5, 6]}\n", [("GW214", 1)]),
    "a family over a family is one finding": (
        "  a: {robot: output_int_register_0..9, modbus: 0}\n  b: {robot: output_double_register_0..9, modbus: 10}\n",
        [("GW214", 2)],
    ),
    "a bit behind a long number": (
        "  a: {robot: output_double_register_0, modbus: 5}\n  b: {robot: output_bit_register_0, modbus: 8.0}\n",
        [("GW215", 2)],
    ),
    "one number over three others": (
        (
            "  a: {robot: output_int_register_0, modbus: {holding: 4, type: int16}, limits: [0, 9]}\n"
            "  b: {robot: output_double_register_0, modbus: 3}\n"
            "  c: {robot: output_int_register_1, modbus: {holding: 6, type: int16}, limits: [0, 9]}\n"
        ),
        [("GW214", 2), ("GW214", 3)],
    ),
}


@pytest.mark.parametrize("lines,expected", OVERLAPS.values(), ids=OVERLAPS.keys())
def test_overlaps(lines: str, expected: list[tuple[str, int]]) -> None:
    assert findings(lines) == expected


FINER_POINTS = {
    "a mirror of an input in a read-only area is fine": (
        "  a: {robot: input_int_register_0, modbus: [10, {input: 10}], owner: plc}\n",
        [],
    ),
    "the word and one of its bits": (
        (
            "  a: {robot: input_bit_registers0_to_31, modbus: 10, owner: plc}\n"
            "  b: {robot: input_bit_register_3, modbus: 12.0, owner: plc}\n"
        ),
        [("GW305", 2)],
    ),
    "a bit and then its word": (
        (
            "  b: {robot: input_bit_register_3, modbus: 12.0, owner: plc}\n"
            "  a: {robot: input_bit_registers0_to_31, modbus: 10, owner: plc}\n"
        ),
        [("GW305", 2)],
    ),
    "the same output twice is fine": (
        "  a: {robot: output_int_register_0, modbus: 10}\n  b: {robot: output_int_register_0, modbus: 12}\n",
        [],
    ),
    "a broken line may be the mask": (
        (
            "  a: {robot: speed_slider_fraction, modbus: 10, owner: plc}\n"
            "  b: {robot: speed_slider_mask, modbus: 1O, owner: plc}\n"
        ),
        [("GW115", 2)],
    ),
    "an address of the manual in its own area only": (
        (
            "  a: {robot: output_bit_register_0, modbus: {coil: 40001}}\n"
            "  b: {robot: output_int_register_0, modbus: {input: 30001}}\n"
        ),
        [("GW204", 2)],
    ),
    "numbers across a block of 125": (
        "  a: {robot: output_double_register_0..47, modbus: 0}\n",
        [("GW212", 1)],
    ),
    "a block that ends in time": (
        (
            "  a: {robot: output_double_register_0..30, modbus: 0}\n"
            "  b: {robot: output_double_register_31..47, modbus: 125}\n"
        ),
        [],
    ),
    "inputs across a block of 123": (
        (
            "  a: {robot: output_bit_register_0, modbus: 5.0}\n"
            "  b: {robot: input_double_register_0..23, modbus: 6, owner: plc}\n"
            "  c: {robot: input_int_register_0..15, modbus: 102, owner: plc}\n"
        ),
        [("GW212", 3)],
    ),
    "small enumerations fit a small type": (
        "  a: {robot: robot_mode, modbus: {holding: 10, type: int16}}\n",
        [],
    ),
    "stated limits make a small type fit": (
        "  a: {robot: output_int_register_0, modbus: {holding: 10, type: int16}, limits: [0, 999]}\n",
        [],
    ),
    "an inverse scale comes out even": (
        "  a: {robot: output_int_register_0, modbus: {holding: 10, type: int64, scale: 0.1}}\n",
        [],
    ),
    "true is no number": (
        "  a: {robot: output_int_register_0, modbus: 10, on_stale: true}\n",
        [("GW602", 1)],
    ),
    "1 is a bit": ("  a: {robot: output_bit_register_0, modbus: 10.0, on_stale: 1}\n", []),
    "a fallback beyond the type": (
        "  a: {robot: input_int_register_0, modbus: 10, owner: plc, on_release: 3000000000}\n",
        [("GW602", 1)],
    ),
    "a family with one mistake is one finding": (
        "  a: {robot: output_int_register_0..23, modbus: {holding: 10, type: int16}, owner: plc, on_stale: 0.5}\n",
        [("GW703", 1), ("GW513", 1), ("GW602", 1)],
    ),
}


def at(robot: str, place: str, more: str = "") -> str:
    """A line with one place in registers."""
    owner = ", owner: plc" if "input" in robot or "slider" in robot else ""
    return f"  a: {{robot: {robot}, modbus: {{holding: 10, {place}}}{owner}{more}}}\n"


@pytest.mark.parametrize(
    "line, found",
    [
        (at("actual_q", "type: uint16, scale: 0.001"), True),
        (at("actual_q", "type: uint16, scale: 0.001, offset: -10"), False),
        (at("actual_q", "type: int16, scale: 0.001"), False),
        (at("actual_q", "type: int16, scale: 0.0001"), True),
        (at("actual_q", "type: int16, scale: 0.0001", ", limits: [-1.5, 1.5]"), False),
        (at("actual_q", "type: int16, scale: 2"), True),
        (at("actual_q", "type: float32"), False),
        (at("actual_TCP_pose", "type: int16, scale: 0.0001"), False),
        (at("actual_TCP_pose", "type: int16, scale: 0.00005"), True),
        (at("speed_scaling", "type: uint16, scale: 1"), True),
        (at("speed_scaling", "type: uint16, scale: 0.01"), False),
        (at("joint_temperatures", "type: uint16, scale: 1"), False),
        (at("timestamp", "type: int32, scale: 0.001"), True),
        (at("output_double_register_0", "type: uint16, scale: 0.1"), False),
        (at("output_double_register_0", "type: uint16, scale: 0.1", ", limits: [-1, 1]"), True),
        (at("input_double_register_0", "type: uint16, scale: 0.1", ", limits: [-1, 1]"), False),
    ],
)
def test_reals_that_registers_can_never_show(line: str, found: bool) -> None:
    """Sign, range and resolution, by what the fields hold in ordinary use, element by element."""
    assert ("GW713" in [rule for rule, _line in findings(line)]) is found


@pytest.mark.parametrize(
    "limits, found",
    [
        ("[0, 1.04]", True),
        ("[0, 1.1]", False),
        ("[0.04, 2]", True),
        ("[-3276.8, 3276.7]", False),
        ("[0, 5000.05]", False),
    ],
)
def test_limits_between_two_steps(limits: str, found: bool) -> None:
    line = at("input_double_register_0", "type: int16, scale: 0.1", f", on_release: hold, limits: {limits}")
    assert ("GW714" in [rule for rule, _line in findings(line)]) is found


@pytest.mark.parametrize("lines,expected", FINER_POINTS.values(), ids=FINER_POINTS.keys())
def test_finer_points(lines: str, expected: list[tuple[str, int]]) -> None:
    assert findings(lines) == expected


@pytest.mark.parametrize(
    "first, second, clash",
    [
        ("0.0.0.0", "192.0.2.2", True),
        ("[::]", "[fd00::2]", True),
        ("[::]", "0.0.0.0", False),
        ("[::]", "192.0.2.2", False),
        ("[::ffff:192.0.2.2]", "0.0.0.0", True),
        ("[::1]", "127.0.0.1", False),
    ],
)
def test_a_wildcard_takes_the_port_of_its_own_family_alone(first: str, second: str, *, clash: bool) -> None:
    """tests/links/modbus_server/test_listener.py opens both wildcards on one port."""
    texts = [
        HEAD.replace("192.0.2.2:1502", f"{host}:1502").replace("press-3", cell).replace("1.10}", f"{end}}}")
        for host, cell, end in ((first, "press-3", "1.10"), (second, "press-4", "1.11"))
    ]
    loaded = load_together([(f"{number}.yaml", text.encode()) for number, text in enumerate(texts)])
    found = [finding.rule.id for file in loaded for finding in file.diagnostics]
    assert ("GW207" in found) is clash


@pytest.mark.parametrize(
    "listen, peer, reaches",
    [
        ("192.0.2.2:502", "192.0.2.20", True),
        ("192.0.2.2:502", "fd00::20", False),
        ("192.0.2.2:502", "['fd00::20', 192.0.2.20]", True),
        ("192.0.2.2:502", "'::ffff:192.0.2.20'", True),
        ("192.0.2.2:502", "'::ffff:192.0.2.0/120'", True),
        ("0.0.0.0:502", "fd00::/64", False),
        ("[::]:502", "fd00::/64", True),
        ("[::]:502", "192.0.2.20", False),
        ("[::]:502", "'::/0'", True),
        ("[::ffff:192.0.2.2]:502", "192.0.2.20", True),
        ("127.0.0.1:502", "'::1'", False),
        ("127.0.0.1:502", "127.0.0.40", True),
        ("[::1]:502", "127.0.0.1", False),
        ("[::1]:502", "'::1'", True),
        ("0.0.0.0:502", "0.0.0.0", False),
        ("0.0.0.0:502", "224.0.0.1", False),
        ("0.0.0.0:502", "255.255.255.255", False),
        ("224.0.0.1:502", "192.0.2.20", False),
        ("255.255.255.255:502", "192.0.2.20", False),
        ("[ff02::1]:502", "'fd00::20'", False),
        ("[fe80::1]:502", "'fe80::2'", False),
        ("[fe80::1%eth0]:502", "'fe80::2'", True),
    ],
)
def test_a_writer_that_can_never_connect_is_a_finding(listen: str, peer: str, *, reaches: bool) -> None:
    mapping = (
        f"gatewayd: 1\ncell: press\nrobot: {{host: 192.0.2.10}}\nmodbus: {{listen: '{listen}'}}\n"
        f"writers:\n  plc:\n    modbus: {peer}\n    timeout: 1s\n"
        "variables:\n  go: {robot: input_bit_register_0, modbus: 0.0, owner: plc}\n"
    )
    found = [finding.rule.id for finding in load(mapping.encode(), "cell.yaml").diagnostics]
    assert ("GW219" not in found) is reaches


def test_an_access_list_that_lets_nobody_in_is_a_finding() -> None:
    head = HEAD.replace("'192.0.2.2:1502'", "'[::]:1502', allow: [192.0.2.0/24]")
    found = load(head.encode(), "cell.yaml").diagnostics
    assert any("the access list lets nobody in" in finding.message for finding in found)


def test_cells_on_different_ports_do_not_clash() -> None:
    """Nothing is shared, nothing is found."""
    other = HEAD.replace("press-3", "press-4").replace("2.10}", "2.11}").replace("1502", "1503")
    loaded = load_together([("a.yaml", HEAD.encode()), ("b.yaml", other.encode())])
    assert [finding for one in loaded for finding in one.diagnostics] == []


def test_an_owner_of_an_output_is_told_the_input() -> None:
    """Outputs that are easily taken for inputs have their counterpart in the hint."""
    hints = []
    for field in ("output_int_register_3", "actual_digital_output_bits", "target_speed_fraction"):
        text = HEAD + f"  a: {{robot: {field}, modbus: 10, owner: plc}}\n"
        hints += [finding.hint for finding in load(text.encode(), "cell.yaml").diagnostics]
    assert hints == [
        "remove `owner`, or map an input such as input_int_register_3",
        "remove `owner`, or map an input such as standard_digital_output (with its mask)",
        "remove `owner`, or map an input such as speed_slider_fraction (with its mask)",
    ]


@pytest.mark.parametrize("peer", ["127.0.0.1", "127.0.0.40", "0.0.0.0/0"])
def test_writers_on_this_machine_reach_a_loopback_listener(peer: str) -> None:
    """So do networks that hold it."""
    head = HEAD.replace("192.0.2.2:", "127.0.0.1:").replace("192.0.2.20", f"'{peer}'").replace("1.21", "1.22")
    found = load(head.encode(), "cell.yaml").diagnostics
    assert [
        (finding.rule.id, "`hmi`" in finding.message) for finding in found if finding.rule.id == "GW219"
    ] == [("GW219", True)]


def test_mistakes_of_all_families_come_in_one_pass() -> None:
    """No finding hides another."""
    lines = (
        "  a: {robot: input_int_register_0, modbus: 60000, owner: nobody, lease: 5}\n"
        "  b: {robot: actual_TCP_poze, modbus: 0}\n"
        "  c: {robot: input_double_register_0, modbus: {holding: 20, type: int16}, owner: plc, limits: [5, 1]}\n"
        "  d: {robot: output_int_register_1, modbus: 20, on_release: hold}\n"
    )
    assert {rule for rule, _ in findings(lines)} == {"GW112", "GW301", "GW608", "GW702", "GW214", "GW605"}


def test_the_largest_cell_is_judged_in_bounded_time() -> None:
    """A thousand overlapping variables cost no more than their sorting."""
    lines = "".join(
        f"  v{n}: {{robot: output_double_register_{n % 48}, modbus: {n % 40}}}\n" for n in range(1000)
    )
    started = time.process_time()
    found = findings(lines)
    assert time.process_time() - started < 10
    assert {rule for rule, _ in found} == {"GW214"}


@pytest.mark.parametrize("side", ["input", "output"])
def test_a_misspelt_reserved_bit_is_recognised(side: str) -> None:
    """The gateway's own names for bits 0 to 63 are no RTDE fields, and what people mean first."""
    text = f"gatewayd: 1\ncell: c\nrobot: {{host: r}}\nvariables: {{a: {{robot: {side}_bit_regster_7}}}}"
    (finding,) = [one for one in load(text.encode(), "c.yaml").diagnostics if one.rule.id == "GW301"]
    assert finding.hint is not None
    assert finding.hint.startswith(f"did you mean `{side}_bit_register_7`")


@pytest.mark.parametrize(
    "place, expected",
    [
        ("{field: dexterity, type: DOUBLE}", ["GW317"]),
        ("{field: dexterity}", ["GW301"]),
        ("dexterity", ["GW301"]),
        ("{field: dexterity, type: REAL}", ["GW114"]),
        ("{field: robot_mode, type: UINT8}", ["GW317"]),
        ("{field: robot_mode, type: INT32}", []),
        ("{field: robot_mode, type: INT32, direction: output}", ["GW522"]),
        ("{field: output_bit_register_5, type: BOOL}", ["GW522"]),
        ("{field: output_int_register_48, type: INT32}", ["GW317"]),
        ("{field: 'new_register_0..3', type: INT32}", ["GW317"]),
        ("{field: 'new_pose[6]', type: VECTOR6D}", ["GW304"]),
        ("{type: DOUBLE}", ["GW109"]),
        ("{field: robot_mode, typ: INT32}", ["GW108"]),
    ],
)
def test_fields_that_are_declared_with_their_type(place: str, expected: list[str]) -> None:
    found = findings(f"  a: {{robot: {place}, modbus: 100}}\n")
    assert [rule for rule, _ in found] == expected


def test_a_field_of_the_newest_controllers_is_not_taken_for_a_slip() -> None:
    found = load((HEAD + "  a: {robot: tool_output_voltage_2, modbus: 100}\n").encode(), "c.yaml").diagnostics
    (hint,) = [one.hint for one in found if one.rule.id == "GW301"]
    assert hint is not None
    assert "{field: tool_output_voltage_2, type: DOUBLE}" in hint
    assert "did you mean" not in hint


def test_a_declared_field_of_an_older_controller_is_only_warned_of() -> None:
    head = HEAD.replace("robot: {", "robot: {version: 5.12, ")
    assert head != HEAD
    lines = "  a: {{robot: {}, modbus: 100}}\n"
    assert [rule for rule, _ in findings(lines.format("control_step"), head)] == ["GW303"]
    declared = lines.format("{field: control_step, type: UINT64}")
    assert [rule for rule, _ in findings(declared, head)] == ["GW317"]


CAN_HEAD = """\
gatewayd: 1
cell: press-3
robot: {host: 192.0.2.10, series: e, frequency: 50}
canopen:
  channel: can0
  bitrate: 1000000
  node: 16
"""


def on_can(lines: str, head: str = CAN_HEAD) -> list[Diagnostic]:
    return list(load((head + lines).encode(), "cell.yaml").diagnostics)


def test_the_number_of_missing_cob_ids_comes_with_free_ones() -> None:
    """Those of both directions do not meet, and what is declared already stays."""
    found = on_can(
        "  cob_ids: {tpdo: [0x680, 0x1C0]}\n"
        "writers: {plc: {canopen: rpdo, node: 1, heartbeat: 1s}}\n"
        "variables:\n"
        "  a: {robot: output_double_register_0..9, canopen: auto}\n"
        "  b: {robot: input_double_register_0..4, canopen: auto}\n"
    )
    assert [(one.rule.id, one.message, one.hint) for one in found] == [
        (
            "GW409",
            "1 of 5 PDOs towards the robot has no COB-ID: four are predefined, and none declared",
            "add `cob_ids: {rpdo: 0x685}` if nobody else uses them",
        ),
        (
            "GW409",
            "4 of 10 PDOs from the robot have no COB-ID: four are predefined, and 2 declared",
            "add `cob_ids: {tpdo: [0x680, 0x1C0, 0x681..0x684]}` if nobody else uses them",
        ),
    ]


def test_a_proposal_goes_on_where_the_free_range_ends() -> None:
    """0x680 to 0x6DF, then PDOs of high node-IDs; all of them pass."""
    head = CAN_HEAD.replace("50}", "1}")
    lines = (
        "variables:\n  a: {robot: output_double_register_0..47, canopen: auto}\n"
        "  b: {robot: actual_q, canopen: auto}\n  c: {robot: target_q, canopen: auto}\n"
        "  d: {robot: actual_qd, canopen: auto}\n  e: {robot: target_qd, canopen: auto}\n"
        "  f: {robot: target_qdd, canopen: auto}\n  g: {robot: actual_current, canopen: auto}\n"
        "  h: {robot: target_current, canopen: auto}\n  i: {robot: target_moment, canopen: auto}\n"
        "  j: {robot: actual_TCP_pose, canopen: auto}\n  k: {robot: target_TCP_pose, canopen: auto}\n"
    )
    (missing,) = (one for one in on_can(lines, head) if one.rule.id == "GW409")
    assert missing.hint == "add `cob_ids: {tpdo: [0x680..0x6DF, 0x1C0..0x1C7]}` if nobody else uses them"
    declared = "  cob_ids: {tpdo: [0x680..0x6DF, 0x1C0..0x1C7]}\n"
    assert "GW409" not in [one.rule.id for one in on_can(declared + lines, head)]


def test_the_hint_of_a_loaded_bus_works() -> None:
    """The inhibit time that it names brings the load below the warning; a millisecond less does not."""
    text = (
        "  cob_ids: {tpdo: 0x680..0x693}\n"
        "variables:\n  a: {robot: output_double_register_0..23, canopen: auto}\n"
    )
    head = CAN_HEAD.replace("50}", "500}")
    (loaded,) = on_can(text, head)
    assert loaded.rule.id == "GW427"
    assert "162% of 1000000 bit/s" in loaded.message
    hint = re.match(r"`pdo: \{inhibit: (\d+)ms\}`", loaded.hint or "")
    assert hint is not None
    milliseconds = int(hint[1])
    assert on_can(f"  pdo: {{inhibit: {milliseconds}ms}}\n{text}", head) == []
    (warned,) = on_can(f"  pdo: {{inhibit: {milliseconds - 1}ms}}\n{text}", head)
    assert warned.rule.id == "GW426"


def test_all_cells_of_a_bus_load_it() -> None:
    """Two cells that pass alone do not pass together; on two buses they do."""
    text = CAN_HEAD.replace("1000000", "125000") + (
        "variables:\n  a: {robot: output_double_register_0..3, canopen: auto}\n"
    )
    other = text.replace("press-3", "press-4").replace("1.10", "1.11").replace("node: 16", "node: 17")
    assert on_can("", text) == []
    together = load_together([("a.yaml", text.encode()), ("b.yaml", other.encode())])
    assert [[one.rule.id for one in cell.diagnostics] for cell in together] == [["GW426"], []]
    assert "from 2 cells" in together[0].diagnostics[0].message
    apart = load_together([("a.yaml", text.encode()), ("b.yaml", other.replace("can0", "can1").encode())])
    assert [cell.diagnostics for cell in apart] == [(), ()]


def test_one_cell_may_receive_what_another_sends() -> None:
    """That is how a TPDO reaches another node, without a master between them."""
    sender = CAN_HEAD + (
        "  pdos: {out: {cob_id: 0x1C0, variables: a}}\nvariables: {a: {robot: output_int_register_0}}\n"
    )
    receiver = (
        (CAN_HEAD.replace("press-3", "press-4").replace("1.10", "1.11").replace("node: 16", "node: 17"))
        + "  identity: {product: 2}\n"
        + "  pdos: {in: {cob_id: 0x1C0, variables: a}}\nwriters: {other: {canopen: rpdo, node: 16, heartbeat: 1s}}\n"
        + "variables: {a: {robot: input_int_register_0, owner: other}}\n"
    )
    both = load_together([("a.yaml", sender.encode()), ("b.yaml", receiver.encode())])
    assert [cell.diagnostics for cell in both] == [(), ()]


@pytest.mark.parametrize(
    "owner, canopen, modbus, rules",
    [
        ("plc", "auto", "10", ["GW423"]),
        ("plc", "object", "10", []),
        ("plc", "object", None, ["GW423"]),
        ("line", "auto", None, []),
        ("line", "object", None, ["GW423"]),
        ("line", None, "10", ["GW423"]),
        ("hmi", "object", None, []),
        ("hmi", "auto", None, ["GW423"]),
        ("[plc, line]", "auto", "10", []),
        ("[plc, line]", "auto", None, ["GW432"]),
        ("[plc, hmi]", "object", "10", []),
        ("[hmi, line]", "object", None, ["GW432"]),
        ("any", "auto", None, []),
    ],
)
def test_every_input_lies_where_an_owner_can_write(
    owner: str, canopen: str | None, modbus: str | None, rules: list[str]
) -> None:
    """plc writes by Modbus, line by RPDO, hmi by SDO."""
    places = "".join(
        f", {key}: {value}" for key, value in (("canopen", canopen), ("modbus", modbus)) if value
    )
    found = on_can(
        "modbus: {listen: '192.0.2.2:1502'}\n"
        "writers:\n"
        "  plc: {modbus: 192.0.2.20, timeout: 1s}\n"
        "  line: {canopen: rpdo, node: 1, heartbeat: 1s}\n"
        "  hmi: {canopen: sdo, node: 2, heartbeat: 1s}\n"
        "variables:\n"
        "  keep: {robot: input_bit_register_9, modbus: 90.0, canopen: auto, owner: any, lease: 2s}\n"
        f"  a: {{robot: input_int_register_0, owner: {owner}{places}}}\n"
    )
    assert [one.rule.id for one in found] == rules


@pytest.mark.parametrize("wrong", ["output_int_register_99", "[]"])
def test_a_broken_variable_makes_no_further_finding_at_its_pdo(wrong: str) -> None:
    """What a PDO names is there, only wrong in itself."""
    found = on_can(
        "  pdos: {p: {variables: a}}\nvariables:\n"
        f"  a: {{robot: {wrong}}}\n  b: {{robot: robot_mode, canopen: auto}}\n"
    )
    assert len(found) == 1
    assert not found[0].rule.id.startswith("GW4")


def test_cob_ids_are_echoed_in_hexadecimal() -> None:
    (found,) = on_can(
        "  pdos: {p: {cob_id: 0x6e5, variables: a}}\nvariables: {a: {robot: output_int_register_0}}\n"
    )
    assert "0x6E5" in found.message


def test_a_growing_real_is_never_enough_in_a_real32() -> None:
    """Even where the line says REAL32 itself."""
    (found,) = on_can("variables: {t: {robot: timestamp, canopen: {type: REAL32}}}\n")
    assert (found.rule.id, found.hint) == ("GW414", "write `canopen: {type: REAL64}`")


PDO_MATES = {
    "bits of several owners": ("owner: [plc, line]", "owner: [plc, line]", ["GW434"]),
    "a bit of several owners beside one of the master's": ("owner: [plc, line]", "owner: line", ["GW434"]),
    "bits of the master alone": ("owner: line", "owner: line", []),
    "bits of one group": ("group: g", "group: g", []),
}


@pytest.mark.parametrize("first, second, rules", PDO_MATES.values(), ids=PDO_MATES.keys())
def test_what_is_mapped_in_one_rpdo_is_meant(first: str, second: str, rules: list[str]) -> None:
    """Bits too: while the PLC holds one of them, the whole PDO is refused."""
    found = on_can(
        "modbus: {listen: '192.0.2.2:1502'}\n"
        "writers:\n"
        "  plc: {modbus: 192.0.2.20, timeout: 1s}\n"
        "  line: {canopen: rpdo, node: 1, heartbeat: 1s}\n"
        "groups: {g: {owner: [plc, line], lease: 2s}}\n"
        "variables:\n"
        f"  a: {{robot: input_bit_register_0, modbus: {{coil: 0}}, canopen: auto, {first}}}\n"
        f"  b: {{robot: input_bit_register_1, modbus: {{coil: 1}}, canopen: auto, {second}}}\n"
        "  c: {robot: input_bit_register_2..3, modbus: {coil: 2}, group: g}\n"
    )
    assert [one.rule.id for one in found if one.rule.id == "GW434"] == rules


GROUP_HEAD = """\
gatewayd: 1
cell: press-3
robot: {host: 192.0.2.10, series: e, frequency: 50}
modbus: {listen: '192.0.2.2:1502'}
canopen:
  channel: can0
  bitrate: 500000
  node: 16
  pdos: {order: {variables: [recipe, batch]}}
writers:
  plc: {modbus: 192.0.2.20, timeout: 1s}
  hmi: {modbus: 192.0.2.21, timeout: 1s}
  line: {canopen: rpdo, node: 1, heartbeat: 1s}
  service: {canopen: sdo, node: 2, heartbeat: 1s}
"""
GROUPS = {
    "side by side": ("owner: [plc, hmi]", "modbus: 10", "modbus: 12", []),
    "in the other order": ("owner: [plc, hmi]", "modbus: 12", "modbus: 10", []),
    "with a gap": ("owner: [plc, hmi]", "modbus: 10", "modbus: 13", ["GW519"]),
    "in two areas": ("owner: [plc, hmi]", "modbus: 10", "modbus: {input: 12}", ["GW519"]),
    "once together, once apart": ("owner: [plc, hmi]", "modbus: 10", "modbus: [12, 20]", []),
    "the lower owner alone could not": ("owner: [plc, line]", "modbus: 10, canopen: object", "modbus: 12", []),
    "in one RPDO of its owner": ("owner: [line, plc]", "modbus: 10", "modbus: 20", []),
    "one RPDO is no use to a Modbus client": ("owner: [plc, line]", "modbus: 10", "modbus: 20", ["GW519"]),
    "by SDO one after the other": ("owner: [service, plc]", "modbus: 10", "modbus: 12", ["GW519"]),
    "nobody takes over": ("owner: [plc, hmi], takeover: false", "modbus: 10", "modbus: 20", []),
    "a single owner": ("owner: plc", "modbus: 10", "modbus: 20", []),
    "first come": ("owner: any", "modbus: 10", "modbus: 20", []),
    "held": ("owner: [plc, hmi]", "modbus: 10, on_release: hold", "modbus: 12", ["GW518"]),
    "held, but whole": ("owner: [plc, hmi], whole: true", "modbus: 10, on_release: hold", "modbus: 12", []),
    "held and apart": ("owner: [plc, hmi]", "modbus: 10", "modbus: 20, on_release: hold", ["GW519", "GW518"]),
    "held, and nobody takes over": (
        "owner: [plc, hmi], takeover: false", "modbus: 10, on_release: hold", "modbus: 12", [],
    ),
    "whole, and nobody takes over": (
        "owner: [plc, hmi], takeover: false, whole: true", "modbus: 10", "modbus: 12", ["GW522"],
    ),
    "whole with a single owner": ("owner: plc, whole: true", "modbus: 10", "modbus: 12", ["GW522"]),
}  # fmt: skip


@pytest.mark.parametrize("group, recipe, batch, rules", GROUPS.values(), ids=GROUPS.keys())
def test_takeovers_of_groups(group: str, recipe: str, batch: str, rules: list[str]) -> None:
    """Who takes over writes the group with one request, and inherits what is held."""
    text = GROUP_HEAD + (
        f"groups: {{order: {{lease: 2s, {group}}}}}\n"
        "variables:\n"
        f"  recipe: {{robot: input_int_register_0, {recipe}, group: order}}\n"
        f"  batch: {{robot: input_int_register_1, {batch}, group: order}}\n"
    )
    found = load(text.encode(), "cell.yaml").diagnostics
    assert [one.rule.id for one in found if one.rule.id in ("GW518", "GW519", "GW522")] == rules


def test_a_group_that_no_request_can_hold() -> None:
    """FC16 writes 123 registers at most."""
    for last, rules in ((29, []), (30, ["GW519"])):
        text = GROUP_HEAD.replace("  pdos: {order: {variables: [recipe, batch]}}\n", "") + (
            "groups: {order: {owner: [plc, hmi], lease: 2s}}\nvariables:\n"
            f"  many: {{robot: 'input_double_register_0..{last}', modbus: 0, group: order}}\n"
        )
        found = load(text.encode(), "cell.yaml").diagnostics
        assert [one.rule.id for one in found if one.rule.id == "GW519"] == rules


SHARED_REGISTERS = {
    "a shared bit beside a bit of one owner": ("owner: [plc, hmi]", "0.1", "owner: plc", [1]),
    "any is several owners": ("owner: any", "0.1", "owner: plc", [1]),
    "two shared bits are two findings": ("owner: any", "0.1", "owner: any", [1, 2]),
    "bits of one owner each": ("owner: hmi", "0.1", "owner: plc", []),
    "in registers of their own": ("owner: any", "1.1", "owner: any", []),
    "one group": ("group: g", "0.1", "group: g", []),
    "a group beside a bit of one owner": ("group: g", "0.1", "owner: plc", [1]),
    "a coil is written on purpose": ("owner: any", "{coil: 1}", "owner: any", []),
    "a coil beside the register": ("owner: plc", "[0.1, {coil: 1}]", "owner: any", []),
}


@pytest.mark.parametrize(
    "first, place, second, lines", SHARED_REGISTERS.values(), ids=SHARED_REGISTERS.keys()
)
def test_bits_that_writing_their_register_does_not_take(
    first: str, place: str, second: str, lines: list[int]
) -> None:
    head = HEAD.replace("variables:\n", "groups: {g: {owner: [plc, hmi], lease: 2s}}\nvariables:\n")
    found = findings(
        f"  a: {{robot: input_bit_register_0, modbus: 0.0, {first}}}\n"
        f"  b: {{robot: input_bit_register_1, modbus: {place}, {second}}}\n"
        "  c: {robot: input_bit_register_2..3, modbus: 9.0, group: g}\n",
        head,
    )
    assert [line for rule, line in found if rule == "GW520"] == lines


def test_any_means_nobody_else_where_there_is_one_writer() -> None:
    """The default owner is no trap in a file with a single writer."""
    head = HEAD.replace("  hmi: {modbus: 192.0.2.21, timeout: 1s}\n", "").replace("[plc, hmi]", "plc")
    assert findings("  a: {robot: input_bit_register_0..7, modbus: 0.0}\n", head) == []


def test_a_family_of_shared_bits_is_one_finding() -> None:
    assert findings("  a: {robot: input_bit_register_0..31, modbus: 0.0, owner: any}\n") == [("GW520", 1)]


SUPERVISED = {
    "no timeout": ("{modbus: 192.0.2.20}", "owner: plc", ["GW521"]),
    "a timeout": ("{modbus: 192.0.2.20, timeout: 2s}", "owner: plc", []),
    "a lease": ("{modbus: 192.0.2.20}", "owner: plc, lease: 2s", []),
    "an RPDO master without a heartbeat": ("{canopen: any}", "owner: plc, canopen: auto", ["GW521"]),
    "a heartbeat": ("{canopen: any, node: 1, heartbeat: 1s}", "owner: plc, canopen: auto", []),
    "reported by the rule about motion": ("{modbus: 192.0.2.20}", "owner: plc, name: go", ["GW604"]),
    "reported by the rule about shared locks": ("{modbus: 192.0.2.20}", "owner: [plc, hmi], lease: none", ["GW514"]),
}  # fmt: skip


@pytest.mark.parametrize("writer, keys, rules", SUPERVISED.values(), ids=SUPERVISED.keys())
def test_a_writer_that_hangs_is_reported_once(writer: str, keys: str, rules: list[str]) -> None:
    keys, _, name = keys.partition(", name: ")
    text = (
        "gatewayd: 1\ncell: c\nrobot: {host: 192.0.2.10, series: e, frequency: 50}\n"
        "modbus: {listen: '192.0.2.2:1502'}\n"
        "canopen: {channel: can0, bitrate: 500000, node: 16}\n"
        f"writers:\n  plc: {writer}\n  hmi: {{modbus: 192.0.2.21, timeout: 1s}}\n"
        "variables:\n"
        f"  {name or 'recipe'}: {{robot: input_int_register_0, modbus: 10, {keys}}}\n"
        "  call: {robot: input_int_register_1, modbus: 12, owner: hmi}\n"
    )
    found = load(text.encode(), "cell.yaml").diagnostics
    assert [one.rule.id for one in found if one.rule.id in ("GW514", "GW521", "GW604")] == rules


COMPANIONS = {
    "a bit and its mask": ("standard_digital_output.3", "standard_digital_output_mask.3", []),
    "a bit and the whole mask": ("standard_digital_output.3", "standard_digital_output_mask", []),
    "a bit and the mask of another": ("standard_digital_output.3", "standard_digital_output_mask.2", ["GW316"]),
    "a word and some of its mask": ("configurable_digital_output", "configurable_digital_output_mask.2", []),
    "a family and a shorter mask": ("tool_digital_output.0..1", "tool_digital_output_mask.0", ["GW316"]),
    "no mask at all": ("tool_digital_output.0", "input_int_register_0", ["GW310"]),
    "the slider": ("speed_slider_fraction", "speed_slider_mask", []),
    "an analog output without mask and domain": (
        "standard_analog_output_1", "input_int_register_0", ["GW310", "GW315"],
    ),
    "an analog output with the mask of the other": (
        "standard_analog_output_1", "standard_analog_output_mask.0", ["GW315", "GW316"],
    ),
    "an analog output with a mask": ("standard_analog_output_1", "standard_analog_output_mask", ["GW315"]),
}  # fmt: skip


@pytest.mark.parametrize("value, companion, rules", COMPANIONS.values(), ids=COMPANIONS.keys())
def test_companions(value: str, companion: str, rules: list[str]) -> None:
    """What an input acts through, bit by bit."""
    found = findings(
        f"  a: {{robot: {value}, modbus: {{coil: 10}}, owner: plc}}\n"
        f"  b: {{robot: {companion}, modbus: {{coil: 20}}, owner: plc}}\n"
    )
    assert [rule for rule, _ in found if rule in ("GW310", "GW315", "GW316")] == rules


WITHOUT_EFFECT = {
    "plc: {modbus: 192.0.2.20, timeout_counts: requests}": ["GW522"],
    "plc: {modbus: 192.0.2.20, timeout: none, timeout_counts: writes}": ["GW522"],
    "plc: {modbus: 192.0.2.20, timeout: 1s, timeout_counts: writes, grace: 1s}": [],
    "plc: {modbus: 192.0.2.20, timeout: 1s, grace: 200ms}": [],
    "plc: {canopen: sdo, node: 1, heartbeat: 1s, grace: 1s}": ["GW522"],
    "plc: {canopen: sdo, node: 1, heartbeat: 1s, grace: none}": [],
}


@pytest.mark.parametrize("writer, rules", WITHOUT_EFFECT.items())
def test_keys_of_writers_that_mean_nothing(writer: str, rules: list[str]) -> None:
    head = HEAD.replace("plc: {modbus: 192.0.2.20, timeout: 1s}", writer)
    head = head.replace("writers:", "canopen: {channel: can0, bitrate: 500000, node: 16}\nwriters:")
    found = findings(
        "  a: {robot: input_int_register_0, modbus: 10, canopen: object, owner: plc, lease: 2s}\n", head
    )
    assert [rule for rule, _ in found if rule == "GW522"] == rules


@pytest.mark.parametrize(
    "robot, rules",
    [
        ("on_connect: fallback, adopt_for: 10s", ["GW522"]),
        ("on_connect: fallback, adopt_for: none", ["GW522"]),
        ("on_connect: fallback", []),
        ("on_connect: adopt, adopt_for: 3s", []),
        ("valid: running", ["GW613"]),
    ],
)
def test_keys_of_the_robot_that_mean_nothing(robot: str, rules: list[str]) -> None:
    head = HEAD.replace("{host: 192.0.2.10}", f"{{host: 192.0.2.10, {robot}}}")
    assert [rule for rule, _ in findings("", head)] == rules
    more = "  a: {robot: output_int_register_0, modbus: 10}\n"
    assert [rule for rule, _ in findings(more, head)] == [rule for rule in rules if rule != "GW613"]


def test_validity_is_for_outputs_of_the_program() -> None:
    """At an input it is an error, at what the controller measures a warning."""
    assert findings(
        "  a: {robot: input_int_register_0, modbus: 10, owner: plc, valid: running}\n"
        "  b: {robot: actual_q, modbus: 20, valid: running}\n"
        "  c: {robot: output_bit_register_0..7, modbus: 50.0, valid: running}\n"
        "  d: {robot: output_bit_register_70, modbus: 51.0, valid: running}\n"
    ) == [("GW605", 1), ("GW613", 2)]


STATUS_PDOS = {
    "status: [flags, robot_state], variables: a": [],
    "status: quality of a": [],
    "status: [flags, fingerprint, heartbeat], variables: bit": ["GW402"],
    "status: [uptime, lag, flags]": ["GW402"],
    "status: flags, variables: b": ["GW404"],
    "status: quality of nothing": ["GW430"],
    "status: 'quality of a[0]'": ["GW430"],
    "status: flags, variables: silent": ["GW433"],
    "status: flags, variables: bit, deadline: 1s": ["GW431"],
    "status: []": ["GW110"],
    "status: flag": ["GW114"],
    "status: release": ["GW114"],
    "variables: []": ["GW110"],
}


@pytest.mark.parametrize("pdo, rules", STATUS_PDOS.items())
def test_words_of_the_status_block_in_a_pdo(pdo: str, rules: list[str]) -> None:
    """They count like variables, and leave in TPDOs only."""
    found = on_can(
        f"  pdos: {{p: {{{pdo}}}}}\nwriters: {{plc: {{canopen: any, node: 1, heartbeat: 1s}}}}\nvariables:\n"
        "  a: {robot: output_int_register_0}\n  bit: {robot: output_bit_register_0}\n"
        "  silent: {robot: output_int_register_1, on_stale: exception}\n"
        "  b: {robot: input_int_register_0}\n  c: {robot: input_int_register_1, canopen: auto}\n"
    )
    assert [one.rule.id for one in found if one.rule.id not in ("GW221", "GW501")] == rules
    assert all(one.hint for one in found)


def test_a_misspelt_status_word_is_recognised() -> None:
    (found,) = on_can(
        "  pdos: {p: {status: [robot_stat]}}\nvariables: {a: {robot: robot_mode, canopen: auto}}\n"
    )
    assert (found.rule.id, found.hint) == ("GW114", "did you mean `robot_state`?")


@pytest.mark.parametrize(
    "rest, hint",
    [
        ("", "leave fields out"),
        ("  z: {robot: input_double_register_0..47, modbus: 500, owner: plc}\n", "leave fields out"),
    ],
)
def test_a_list_that_is_too_long_in_itself(rest: str, hint: str) -> None:
    """`verify: false` is no remedy for outputs."""
    head = HEAD.replace("{host: 192.0.2.10}", "{host: 192.0.2.10, series: cb3}")
    lines = (
        "  a: {robot: output_double_register_0..47, modbus: 0}\n"
        "  b: {robot: output_int_register_0..47, modbus: 200}\n"
    )
    found = load((head + lines + rest).encode(), "cell.yaml").diagnostics
    assert [one.hint for one in found if one.rule.id == "GW308"] == [hint]


def test_read_backs_make_the_list_too_long() -> None:
    """Without them it fits: that is what `verify: false` does."""
    head = HEAD.replace("{host: 192.0.2.10}", "{host: 192.0.2.10, series: cb3}")
    lines = (
        "  a: {robot: output_double_register_0..47, modbus: 0}\n"
        "  b: {robot: input_double_register_0..47, modbus: 500, owner: plc}\n"
    )
    found = load((head + lines).encode(), "cell.yaml").diagnostics
    (long,) = [one for one in found if one.rule.id == "GW308"]
    assert long.hint == "write `verify: false` if no input needs to be, or leave fields out"
    quiet = head.replace("series: cb3}", "series: cb3, verify: false}")
    assert "GW308" not in [rule for rule, _ in findings(lines, quiet)]


def test_a_file_without_writers_is_told_how_its_bus_knows_them() -> None:
    (found,) = on_can("variables: {a: {robot: input_int_register_0, canopen: auto}}\n")
    assert (found.rule.id, found.hint) == (
        "GW501",
        "add `writers: {plc: {canopen: rpdo, node: 1, heartbeat: 1s}}`",
    )

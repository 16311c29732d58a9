"""From the CANopen part of a file to objects and PDOs."""

from __future__ import annotations

import time

from gatewayd.canopen.datatypes import CanType
from gatewayd.core.definition import Direction
from gatewayd.links.canopen_node.expand import CanopenCell, ExpandedPdo, MemberProblem, node_of
from gatewayd.mapping.expand import expand
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.reader import read_document
from gatewayd.mapping.source import parse

HEAD = """\
gatewayd: 1
cell: press-3
robot: {host: 192.0.2.10}
writers:
  line: {canopen: any}
canopen:
  channel: can0
  bitrate: 500000
  node: 16
"""


def expanded(canopen: str, variables: str) -> ExpandedCell:
    text = f"{HEAD}{canopen}variables:\n{variables}"
    document, findings = read_document(parse(text.encode(), "cell.yaml"))
    assert findings == ()
    return expand(document)


def node(canopen: str, variables: str) -> CanopenCell:
    found = node_of(expanded(canopen, variables))
    assert found is not None
    return found


def pdo(found: CanopenCell, name: str) -> ExpandedPdo:
    return next(one for one in found.pdos if one.name == name)


def contents(found: CanopenCell) -> list[tuple[str, list[int]]]:
    return [(one.label, [entry.variable for entry in one.entries]) for one in found.pdos]


def test_default_types_follow_the_robot() -> None:
    found = node(
        "",
        """\
  bit: {robot: output_bit_register_0, canopen: object}
  number: {robot: output_int_register_0, canopen: object}
  word: {robot: output_bit_registers0_to_31, canopen: object}
  wide: {robot: actual_digital_input_bits, canopen: object}
  small: {robot: tool_output_mode, canopen: object}
  real: {robot: output_double_register_0, canopen: object}
""",
    )
    assert [one.plan.type for one in found.objects] == [
        CanType.BOOLEAN,
        CanType.INTEGER32,
        CanType.UNSIGNED32,
        CanType.UNSIGNED64,
        CanType.UNSIGNED8,
        CanType.REAL64,
    ]
    assert found.pdos == ()


def test_reals_take_the_type_of_the_section_unless_they_name_their_own() -> None:
    found = node(
        "  pdo: {real: REAL32}\n",
        """\
  a: {robot: output_double_register_0, canopen: auto}
  b: {robot: output_double_register_1, canopen: {type: REAL64}}
""",
    )
    assert [one.plan.type for one in found.objects] == [CanType.REAL32, CanType.REAL64]


def test_a_pdo_lists_its_variables_and_variables_name_their_pdo() -> None:
    """First those that it lists, in its order; then those that ask for it, in the order of the file."""
    found = node(
        "  pdos:\n    state: {cob_id: 0x1C0, variables: ['word[1]', word_2]}\n",
        """\
  word: {robot: output_int_register_0..1, canopen: {type: INTEGER16}}
  word_2: {robot: output_int_register_2, canopen: {type: INTEGER16}}
  late: {robot: output_int_register_3, canopen: {pdo: state, type: INTEGER16}}
  free: {robot: output_int_register_4, canopen: auto}
""",
    )
    assert contents(found) == [("TPDO 1", [0, 4]), ("TPDO 2 (state)", [1, 2, 3])]
    assert found.is_complete


def test_a_listed_variable_needs_no_key_of_its_own() -> None:
    found = node("  pdos: {state: {variables: busy}}\n", "  busy: {robot: output_bit_register_0}\n")
    assert contents(found) == [("TPDO 1 (state)", [0])]
    assert [one.plan.index for one in found.objects] == [0x2400]


def test_a_variable_not_on_canopen_has_no_object() -> None:
    found = node("", "  a: {robot: robot_mode}\n  b: {robot: safety_mode, canopen: auto}\n")
    assert [one.variable for one in found.objects] == [1]


def test_defaults_of_the_section_and_exceptions_from_them() -> None:
    """`none` is an exception too."""
    found = node(
        """\
  pdo: {transmission: 3, inhibit: 20ms, event: 1s, deadline: 2s}
  pdos:
    own: {transmission: event, inhibit: none, event: 500ms, variables: a}
    rest: {variables: b, sync_start: 4}
    in: {variables: c}
""",
        """\
  a: {robot: output_int_register_0}
  b: {robot: output_int_register_1}
  c: {robot: input_int_register_1, owner: line}
""",
    )
    own, rest, towards = pdo(found, "own"), pdo(found, "rest"), pdo(found, "in")
    assert (own.transmission, own.inhibit, own.event) == (254, None, 0.5)
    assert (rest.transmission, rest.inhibit, rest.event, rest.sync_start) == (3, 0.02, 1.0, 4)
    assert (towards.direction, towards.event) == (Direction.INPUT, 2.0)


def test_what_a_pdo_cannot_have_is_kept_for_the_rules() -> None:
    found = node(
        """\
  pdos:
    one: {variables: [a, a, nobody, 'f[2..5]']}
    two: {variables: [a, kept]}
    three: {}
""",
        """\
  a: {robot: output_int_register_0}
  f: {robot: output_int_register_1..3}
  kept: {robot: output_int_register_5, canopen: object}
""",
    )
    assert [(wrong.pdo, wrong.text, wrong.problem, wrong.other) for wrong in found.misnamed] == [
        ("one", "a", MemberProblem.TAKEN, "one"),
        ("one", "nobody", MemberProblem.UNKNOWN, ""),
        ("one", "f[2..5]", MemberProblem.UNKNOWN, ""),
        ("two", "a", MemberProblem.TAKEN, "one"),
        ("two", "kept", MemberProblem.OBJECT_ONLY, ""),
    ]
    assert found.empty == ("two", "three")
    assert not found.is_complete


def test_a_cell_that_cannot_be_laid_out_is_not_complete() -> None:
    """Types that do not fit, PDOs that are too long, mixed, or without a COB-ID."""
    reals = "  d: {robot: output_double_register_0..4, canopen: auto}\n"
    assert not expanded("", reals).is_complete
    assert expanded("  cob_ids: {tpdo: 0x680}\n", reals).is_complete
    assert not expanded("", "  d: {robot: output_double_register_0, canopen: {type: BOOLEAN}}\n").is_complete
    long = "  pdos: {p: {variables: d}}\n"
    assert not expanded(long, "  d: {robot: output_double_register_0..1}\n").is_complete
    mixed = "  o: {robot: output_bit_register_0}\n  i: {robot: input_bit_register_0, owner: line}\n"
    assert not expanded("  pdos: {p: {variables: [o, i]}}\n", mixed).is_complete


def test_no_file_can_make_it_work_for_long() -> None:
    """Hundreds of PDOs that all want the same thousand variables."""
    pdos = "".join(f"    p{number}: {{variables: [{', '.join(['d'] * 64)}]}}\n" for number in range(400))
    started = time.perf_counter()
    found = node(f"  pdos:\n{pdos}", "  d: {robot: output_bit_register_0..127}\n")
    assert time.perf_counter() - started < 10
    assert 2000 < len(found.misnamed) < 4000


STATUS = """\
  ready: {robot: output_bit_register_0}
  recipe: {robot: output_int_register_0..2, canopen: object}
  far: {robot: output_int_register_9}
"""


def test_status_words_come_before_the_variables() -> None:
    """In the order of the list; a family has one word for each member, and need not be on CANopen itself."""
    found = pdo(
        node("  pdos: {state: {status: [flags, quality of far, uptime], variables: ready}}\n", STATUS),
        "state",
    )
    assert [(offset, word.name) for offset, word in found.status_offsets] == [
        (0, "flags"),
        (16, "quality of far"),
        (32, "uptime"),
    ]
    assert [offset for offset, _ in found.offsets] == [64]
    assert (found.bits, found.label) == (65, "TPDO 1 (state)")


def test_a_pdo_of_status_words_alone_is_a_tpdo() -> None:
    found = node("  pdos: {state: {status: quality of recipe}}\n", STATUS)
    assert found.is_complete
    (one,) = found.pdos
    assert (one.direction, one.entries) == (Direction.OUTPUT, ())
    assert [(word.index, word.subindex, word.quality_of) for word in one.status] == [
        (0x5F40, 2, 1),
        (0x5F40, 3, 2),
        (0x5F40, 4, 3),
    ]


def test_the_quality_of_nothing_is_kept_for_the_rules() -> None:
    found = node("  pdos: {state: {status: [flags, 'quality of recipe[7]', quality of nothing]}}\n", STATUS)
    assert [(one.pdo, one.text, one.problem) for one in found.misnamed] == [
        ("state", "recipe[7]", MemberProblem.UNKNOWN),
        ("state", "nothing", MemberProblem.UNKNOWN),
    ]
    assert not found.is_complete


def test_status_words_make_a_pdo_one_that_is_sent() -> None:
    """Whatever variables stand beside them."""
    found = node("  pdos: {p: {status: flags, variables: go}}\n", "  go: {robot: input_bit_register_0}\n")
    assert pdo(found, "p").direction is Direction.OUTPUT
    assert not found.is_complete

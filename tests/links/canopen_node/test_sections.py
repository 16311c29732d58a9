"""The CANopen part of the language: what it takes, and how a mistake in it is reported."""

from __future__ import annotations

import pytest

from gatewayd.links.canopen_node.plan import CanopenPlan
from gatewayd.links.canopen_node.sections import Canopen, CanopenPlace, CanopenPlaces
from gatewayd.mapping.diagnostics import Diagnostic
from gatewayd.mapping.document import Document
from gatewayd.mapping.loader import load
from gatewayd.mapping.reader import read_document
from gatewayd.mapping.rules.writers import is_supervised
from gatewayd.mapping.source import parse

HEAD = "gatewayd: 1\ncell: c\nrobot: {host: r}\nvariables: {}\n"


def read(text: str) -> tuple[Document, tuple[Diagnostic, ...]]:
    return read_document(parse((HEAD + text).encode(), "f"))


def section(text: str) -> Canopen:
    document, findings = read(f"canopen: {{channel: can0, bitrate: 500000, node: 16{text}}}")
    assert findings == ()
    part = document.part(Canopen)
    assert part is not None
    return part.spec


def test_defaults() -> None:
    spec = section("")
    assert (spec.interface, spec.autostart, spec.heartbeat) == ("socketcan", False, 0.5)
    assert (spec.sync.cob_id, spec.sync.producer, spec.sync.period, spec.sync.counter) == (
        0x80,
        False,
        None,
        0,
    )
    assert (spec.pdo.transmission, spec.pdo.inhibit, spec.pdo.event, spec.pdo.real) == (
        254,
        None,
        None,
        "REAL64",
    )


def test_everything_at_once() -> None:
    spec = section(
        ", interface: slcan, autostart: true, heartbeat: none,"
        " sync: {cob_id: 0x90, producer: true, period: 5ms, counter: 10},"
        " pdo: {transmission: sync, deadline: 1s, real: REAL32}, cob_ids: {tpdo: [0x680, 0x690..0x69F], rpdo: 0x6A0},"
        " pdos: {forces: {cob_id: 0x1C0, sync_start: 3, variables: [a, 'b[1..2]'], comment: two}}"
    )
    assert (spec.interface, spec.autostart, spec.heartbeat) == ("slcan", True, None)
    assert (spec.sync.cob_id, spec.sync.producer, spec.sync.period, spec.sync.counter) == (
        0x90,
        True,
        0.005,
        10,
    )
    assert spec.cob_ids.tpdo == (range(0x680, 0x681), range(0x690, 0x6A0))
    assert [member.text for member in spec.pdos["forces"].variables] == ["a", "b[1..2]"]


@pytest.mark.parametrize(
    "text, place",
    [
        ("auto", CanopenPlace()),
        ("object", CanopenPlace(pdo="none")),
        ("{pdo: forces, type: REAL32}", CanopenPlace(pdo="forces", type="REAL32")),
        ("{type: UNSIGNED8}", CanopenPlace(type="UNSIGNED8")),
    ],
)
def test_a_variable_says_where_it_is(text: str, place: CanopenPlace) -> None:
    text = f"variables: {{a: {{robot: robot_mode, canopen: {text}}}}}"
    document, findings = read_document(
        parse(f"{HEAD.removesuffix('variables: {}' + chr(10))}{text}".encode(), "f")
    )
    assert findings == ()
    assert document.variables["a"].spec.by(CanopenPlaces).canopen == place


@pytest.mark.parametrize(
    "text, slug, hint",
    [
        ("{bitrate: 500000, node: 16}", "missing-key", "the bus"),
        ("{channel: can0, bitrate: 500000, node: 128}", "out-of-range", "node-ID"),
        ("{channel: can0, bitrate: 0, node: 1}", "out-of-range", "bit/s"),
        ("{channel: 0, bitrate: 500000, node: 1}", "wrong-type", "quotes"),
        ("{channel: can0, bitrate: 500000, node: 1, heartbeat: 500}", "bad-duration", "500ms"),
        ("{channel: can0, bitrate: 500000, node: 1, sync: {perod: 1ms}}", "unknown-key", "`period`"),
        ("{channel: can0, bitrate: 500000, node: 1, sync: {counter: 1}}", "out-of-range", "2 to 240"),
        ("{channel: can0, bitrate: 500000, node: 1, pdo: {real: float}}", "bad-choice", "REAL64"),
        ("{channel: can0, bitrate: 500000, node: 1, pdos: {p: {cobid: 0x1C0}}}", "unknown-key", "`cob_id`"),
        (
            "{channel: can0, bitrate: 500000, node: 1, pdos: {auto: {variables: a}}}",
            "bad-name",
            "another name",
        ),
        ("{channel: can0, bitrate: 500000, node: 1, pdos: {9p: {variables: a}}}", "bad-name", "letter"),
        (
            "{channel: can0, bitrate: 500000, node: 1, pdos: {p: {sync_start: 241}}}",
            "out-of-range",
            "counter",
        ),
    ],
)
def test_mistakes_are_reported_with_a_remedy(text: str, slug: str, hint: str) -> None:
    _, (finding,) = read(f"canopen: {text}")
    assert finding.rule.slug == slug
    assert hint in (finding.hint or "")


@pytest.mark.parametrize("text", ["yes", "1", "[auto]", "automatic", "{pdo: 1}", "{object: true}"])
def test_other_places_are_refused(text: str) -> None:
    text = f"gatewayd: 1\ncell: c\nrobot: {{host: r}}\nvariables: {{a: {{robot: robot_mode, canopen: {text}}}}}\n"
    _, (finding,) = read_document(parse(text.encode(), "f"))
    assert finding.hint


@pytest.mark.parametrize(
    "text, slugs",
    [
        ("{canopen: rpdo}", []),
        ("{canopen: any, modbus: 192.0.2.1, node: 1, heartbeat: 1s}", []),
        ("{timeout: 1s}", ["missing-key"]),
        ("{canopen: pdo}", ["bad-choice"]),
        ("{canopen: rpdo, node: 0}", ["out-of-range"]),
    ],
)
def test_writers(text: str, slugs: list[str]) -> None:
    _, findings = read(f"writers: {{line: {text}}}")
    assert [finding.rule.slug for finding in findings] == slugs


def test_supervision_of_a_writer() -> None:
    """A heartbeat says something of the CANopen side alone."""
    writers = read(
        "writers: {a: {canopen: rpdo}, b: {canopen: rpdo, node: 1, heartbeat: 1s}, c: {canopen: any, timeout: 1s},"
        " d: {canopen: sdo, modbus: 192.0.2.1, node: 1, heartbeat: 1s}}"
    )[0].writers
    assert {name: is_supervised(part.spec) for name, part in writers.items()} == {
        "a": False,
        "b": True,
        "c": True,
        "d": False,
    }


def test_parameters_of_services() -> None:
    """What a master would have to write at every boot of the node."""
    text = HEAD.replace("robot: {host: r}", "robot: {host: 127.0.0.9}").replace(
        "variables: {}", "variables: {a: {robot: output_int_register_0, canopen: auto}}"
    )
    loaded = load(
        (
            text
            + "canopen: {channel: can0, bitrate: 500000, node: 16, heartbeat: none, sync: {window: 2ms}, "
            "guarding: {time: 100ms}, emcy: {inhibit: 50ms}, on_communication_error: stop}\n"
        ).encode(),
        "f",
    )
    assert loaded.plan is not None, loaded.diagnostics
    node = loaded.plan.the(CanopenPlan)
    assert (node.sync.window, node.guard_time, node.life_time_factor) == (2000, 100, 3)
    assert (node.emcy_inhibit, node.error_behaviour) == (500, 2)


def test_numbers_of_the_identity() -> None:
    identity = section(", identity: {vendor: 0x319, product: 7, revision: auto, serial: 0xFFFFFFFF}").identity
    assert (identity.vendor, identity.product, identity.revision, identity.serial) == (
        793,
        7,
        "auto",
        2**32 - 1,
    )


@pytest.mark.parametrize("text", ["vendor: 0x100000000", "vendor: -1", "revision: automatic", "serial: 1.5"])
def test_what_is_no_number_of_32_bits_is_refused(text: str) -> None:
    _, findings = read(f"canopen: {{channel: can0, bitrate: 500000, node: 16, identity: {{{text}}}}}")
    assert len(findings) == 1
    assert "32 bits" in f"{findings[0].message} {findings[0].hint}"


GUARDED = """\
gatewayd: 1
cell: c
robot: {host: 127.0.0.9}
canopen: {channel: can0, bitrate: 500000, node: 16, heartbeat: %s}
writers: {old: {canopen: rpdo, guarding: 300ms}}
variables: {a: {robot: input_int_register_0, canopen: auto, owner: old}}
"""


def test_guarding_supervises_a_writer() -> None:
    loaded = load((GUARDED % "none").encode(), "f")
    assert loaded.plan is not None
    assert loaded.diagnostics == (), "no GW521: it is supervised"
    (guarded,) = loaded.plan.the(CanopenPlan).guarded
    assert (guarded.timeout, guarded.writer) == (300, 0)


def test_a_node_with_a_heartbeat_cannot_be_guarded() -> None:
    loaded = load((GUARDED % "500ms").encode(), "f")
    assert [finding.rule.id for finding in loaded.diagnostics] == ["GW437"]


TWO_WRITERS = """\
gatewayd: 1
cell: c
robot: {host: 127.0.0.9}
canopen:
  channel: can0
  bitrate: 500000
  node: 16
  pdos:
    command: {cob_id: 0x210, variables: start}
    jog: {cob_id: 0x310, variables: speed}
writers:
  line: {canopen: rpdo, node: 1, heartbeat: 1s}
  hand: {canopen: rpdo, pdos: jog, node: 2, heartbeat: 1s}
variables:
  start: {robot: input_bit_register_0, owner: line}
  speed: {robot: input_double_register_0, owner: hand}
"""


def test_a_writer_has_the_pdos_that_it_names_and_another_one_the_rest() -> None:
    loaded = load(TWO_WRITERS.encode(), "f")
    assert loaded.plan is not None
    assert loaded.diagnostics == ()
    node = loaded.plan.the(CanopenPlan)
    assert (node.rpdo_writer, node.rpdo_writers) == (0, {2: 1})


@pytest.mark.parametrize(
    "old, new",
    [
        ("pdos: jog,", "pdos: fast,"),
        ("owner: hand", "owner: line"),
        ("{canopen: rpdo, pdos: jog,", "{canopen: sdo, pdos: jog,"),
    ],
)
def test_pdos_that_a_writer_cannot_have(old: str, new: str) -> None:
    loaded = load(TWO_WRITERS.replace(old, new).encode(), "f")
    assert "GW439" in [finding.rule.id for finding in loaded.diagnostics]

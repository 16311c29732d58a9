"""From the tree to typed parts: every mistake at its place, none hidden by another."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.mapping.diagnostics import Diagnostic
from gatewayd.mapping.document import Document
from gatewayd.mapping.reader import read_document
from gatewayd.mapping.source import parse

HEAD = "gatewayd: 1\ncell: c\nrobot: {host: r}\n"


def read(text: str) -> tuple[Document, tuple[Diagnostic, ...]]:
    return read_document(parse(text.encode(), "cell.yaml"))


def only(text: str) -> Diagnostic:
    """The one finding of a file."""
    _, findings = read(text)
    assert len(findings) == 1, [(finding.rule.slug, finding.message) for finding in findings]
    return findings[0]


def place(finding: Diagnostic) -> tuple[str, int, int]:
    return finding.rule.slug, finding.position.line, finding.position.column


def test_good_file_has_no_findings() -> None:
    document, findings = read(HEAD + "variables: {a: {robot: input_int_register_0, modbus: 0.3}}")
    assert findings == ()
    assert document.cell == "c"
    assert list(document.sections) == ["robot"]
    assert list(document.variables) == ["a"]


@pytest.mark.parametrize(
    "text, slug, line, column",
    [
        ("cell: c\nrobot: {host: r}\nvariables: {}", "format-version", 1, 1),
        ("gatewayd: 2\ncell: c\nrobot: {host: r}\nvariables: {}", "format-version", 1, 11),
        ("gatewayd: '1'\ncell: c\nrobot: {host: r}\nvariables: {}", "format-version", 1, 11),
        ("gatewayd: 1\nrobot: {host: r}\nvariables: {}", "missing-key", 1, 1),
        ("gatewayd: 1\ncell: C\nrobot: {host: r}\nvariables: {}", "bad-name", 2, 7),
        ("gatewayd: 1\ncell: c\nrobot: {}\nvariables: {}", "missing-key", 3, 1),
        ("gatewayd: 1\ncell: c\nrobot: [r]\nvariables: {}", "wrong-type", 3, 8),
        (HEAD + "variables: {a: {robot: x, modbus: *b}}", "anchor-or-alias", 4, 35),
        (HEAD + "variables: []", "wrong-type", 4, 12),
        (HEAD + "variables:", "wrong-type", 4, 1),
        (HEAD + "variables: {}\nmodbs: {}", "unknown-key", 5, 1),
        (HEAD + "variables: {9a: {robot: x}}", "bad-name", 4, 13),
        (HEAD + "variables: {a: x}", "wrong-type", 4, 16),
        (HEAD + "variables: {a: {robot: x, on_relase: hold}}", "unknown-key", 4, 27),
        (HEAD + "variables: {a: {robot: x, modbus: {holding: 1, scle: 2}}}", "unknown-key", 4, 48),
        (HEAD + "variables: {a: {robot: x, modbus: [1, {coil: 1.2}]}}", "bad-address", 4, 39),
        (HEAD + "variables: {a: {modbus: 1}}", "missing-key", 4, 13),
        (HEAD + "variables: {a: {robot: x, owner: }}", "wrong-type", 4, 27),
        (HEAD + "variables: {a: {robot: x, limits: [1, 0x10]}}", "bad-number", 4, 39),
        (HEAD + "variables: {a: {robot: x, limits: [1]}}", "wrong-type", 4, 35),
        (HEAD + "variables: {a: {robot: x, clamp: yes}}", "wrong-type", 4, 34),
        (HEAD + "variables: {}\nwriters: {any: {modbus: 1.2.3.4}}", "bad-name", 5, 11),
        (HEAD + "variables: {}\nwriters: {plc: {}}", "missing-key", 5, 11),
        (HEAD + "variables: {}\nmodbus: {unit: 300}", "out-of-range", 5, 16),
        (HEAD + "variables: {}\nmodbus: {order: abcd}", "bad-choice", 5, 17),
        (HEAD + "variables: {a: {robot: x, valid: stopped}}", "bad-choice", 4, 34),
        (HEAD + "variables: {}\nwriters: {plc: {modbus: 1.2.3.4, grace: 2}}", "bad-duration", 5, 41),
        (
            HEAD + "variables: {}\nwriters: {plc: {modbus: 1.2.3.4, timeout_counts: reads}}",
            "bad-choice",
            5,
            50,
        ),
        (HEAD.replace("host: r", "host: r, adopt_for: 10") + "variables: {}", "bad-duration", 3, 29),
        (HEAD.replace("host: r", "host: r, adopt_for: never") + "variables: {}", "bad-duration", 3, 29),
        (HEAD.replace("host: r", "host: r, valid: true") + "variables: {}", "bad-choice", 3, 25),
        (HEAD + "variables: {}\ngroups: {g: {whole: 1}}", "wrong-type", 5, 21),
    ],
)
def test_each_mistake_is_found_once_at_its_place(text: str, slug: str, line: int, column: int) -> None:
    """The value, the key, or the key of the table that misses something."""
    finding = only(text)
    assert place(finding) == (slug, line, column)
    assert finding.hint


@pytest.mark.parametrize(
    "line, words",
    [
        ("variables: {a: {robot: x, on_relase: hold}}", "did you mean `on_release`?"),
        ("variables: {a: {robot: x, scale: 2}}", "belongs to the placement"),
        ("variables: {a: {robot: x, modbus: {holding: 1, limits: [0, 1]}}}", "belongs to the variable"),
        ("variables: {}\nhost: r", "belongs in the section `robot`"),
        ("variables: {}\nadopt_for: 5s", "belongs in the section `robot`"),
        ("variables: {a: {robot: x, whole: true}}", "belongs to the group"),
        ("variables: {a: {robot: x, timeout: 1s}}", "belongs to the writer"),
        ("variables: {}\ngroups: {g: {grace: 1s}}", "belongs to the writer"),
        ("variables: {}\nmodbus: {order: abcd}", "did you mean `ABCD`?"),
        ("variables: {}\nmodbus: {gaps: nul}", "write `refuse` or `zero`"),
        ("variables: {}\nmodbus: {zzz: 1}", "known keys: listen, unit"),
        ("variables: {}\nmodbus: {idle_timeout: 60}", "60s"),
        ("variables: {a: {robot: x, modbus: {holding: 400101}}}", "{holding: 100}"),
        ("variables: {a: {robot: x, modbus: {holding: 1, scale: 0,1}}}", "write a point, such as 0.1"),
        ("variables: {a: {robot: x, modbus:1}}", "write `modbus: 1`"),
        ("variables: {a: {robot: x, modbus:\u00a01}}", "no-break space"),
        ("variables: {a: {robot: x, limits: 0..9}}", "[least, greatest]"),
        ("variables: {a: {robot: x, modbus: {holding: 1, type: word}}}", "write uint16 for word"),
        ("variables: {a: {robot: x, modbus: {holding: 1, type: DINT}}}", "write int32"),
    ],
)
def test_hint_names_the_remedy(line: str, words: str) -> None:
    assert words in str(only(HEAD + line).hint)


@pytest.mark.parametrize(
    "host, hint",
    [
        ("192.0.2.300", "four numbers"),
        ("192.0.2", "four numbers"),
        ("192.0.2.010", "leading zeros"),
        ("192.0.2.10:30004", "`port: 30004`"),
        ("robot:rtde", "192.0.2.10"),
    ],
)
def test_what_looks_like_an_address_must_be_one(host: str, hint: str) -> None:
    """No name server knows `192.0.2.300`, and the plant would be the first to tell."""
    finding = only(f"gatewayd: 1\ncell: c\nrobot: {{host: '{host}'}}\nvariables: {{}}")
    assert place(finding) == ("bad-network-address", 3, 15)
    assert hint in str(finding.hint)


@pytest.mark.parametrize("host", ["192.0.2.10", "fe80::1%eth0", "::1", "ur10-press.plant.local", "ur10"])
def test_hosts(host: str) -> None:
    _, findings = read(f"gatewayd: 1\ncell: c\nrobot: {{host: '{host}'}}\nvariables: {{}}")
    assert findings == ()


def test_one_bad_part_hides_no_finding_of_another() -> None:
    """Every part is looked at, and the good ones are kept."""
    document, findings = read(
        "gatewayd: 1\ncell: c\nrobot: {host: 5}\nmodbus: {unit: 0}\n"
        "variables:\n  a: {robot: x, clamp: 1}\n  b: {robot: input_int_register_0}\n  c: {}\n"
    )
    assert [finding.position.line for finding in findings] == [3, 4, 6, 8]
    assert (document.sections, list(document.variables)) == ({}, ["b"])
    assert document.declared("variables") == {"a", "b", "c"}
    assert document.has("modbus")
    assert not document.has("writers")


def test_unreadable_file_gives_an_empty_document() -> None:
    document, findings = read("a: [")
    assert document.cell == ""
    assert [finding.rule.slug for finding in findings] == ["yaml-syntax"]
    assert (document.at("robot").line, document.declared("variables")) == (1, frozenset())


KEYS = """gatewayd cell robot modbus writers groups variables host listen unit type owner lease limits holding coil
scale a watchdog requires on_stale group"""
keys = st.sampled_from(KEYS.split())
values = st.sampled_from(
    ["1", "0.10", "x", "''", "~", "1ms", "[1, 2]", "any", "true", "1.2.3.4", "x_0..3", "-1"]
)
tables = st.recursive(
    values,
    lambda inner: (
        st.dictionaries(keys, inner, max_size=4).map(
            lambda table: "{" + ", ".join(f"{key}: {value}" for key, value in table.items()) + "}"
        )
        | st.lists(inner, max_size=3).map(lambda items: "[" + ", ".join(items) + "]")
    ),
    max_leaves=12,
)


@given(st.dictionaries(keys, tables, max_size=6))
def test_no_tree_raises(table: dict[str, str]) -> None:
    """Any shape of file gives parts and findings with words and places."""
    _, findings = read("".join(f"{key}: {value}\n" for key, value in table.items()))
    assert all(finding.message and finding.position.line > 0 for finding in findings)

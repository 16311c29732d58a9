"""Whatever a file holds, `check` answers with findings, in bounded time, and never with an exception."""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any, TypeAlias

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gatewayd.links.canopen_node.eds import eds_text, objects_of, sheet_of
from gatewayd.links.canopen_node.plan import canopen_of
from gatewayd.mapping.diagnostics import Severity
from gatewayd.mapping.loader import Loaded, load, load_together
from gatewayd.mapping.source import parse
from gatewayd.report.findings import CheckOutcome, as_github, as_json, as_text
from gatewayd.report.table import as_csv, as_markdown, rows
from gatewayd.report.table import as_json as table_as_json
from tests.mapping.values import plain

ROOT = Path(__file__).parents[2]
SEEDS = [
    *sorted((ROOT / "mappings").glob("*.yaml")),
    *sorted((ROOT / "gatewayd").rglob("GW*/*.yaml")),
]
SLOW = 5.0
"""Seconds; a thousand times what a check takes, for a machine that does something else."""

SEED = st.integers(0, 2**32)
"""A mutation is drawn from a seed, not from the bytes of hypothesis: shrinking it would mean nothing."""

Tree: TypeAlias = Any
Change: TypeAlias = Callable[[random.Random, bytes], bytes]


def examine(data: bytes) -> Loaded:
    """Check, report and, where it passes, show: the whole way of a file."""
    started = time.perf_counter()
    loaded = load(data, "cell.yaml")
    outcome = CheckOutcome(("cell.yaml",), loaded.diagnostics)
    lines = data.count(b"\n") + data.count(b"\r") + data.count(b"\x85") + data.count(b"\xe2\x80") + 2
    for finding in loaded.diagnostics:
        assert 1 <= finding.position.line <= lines
        assert finding.position.column >= 1
        assert finding.message
    for written in (as_text(outcome), as_json(outcome), as_github(outcome)):
        written.encode("utf-8", "surrogatepass")
    assert len(as_text(outcome).splitlines()) >= len(loaded.diagnostics)
    failed = any(finding.severity is Severity.ERROR for finding in loaded.diagnostics)
    assert (loaded.plan is None) == failed
    if loaded.plan is not None:
        table = rows(loaded.cell)
        assert as_csv(table)
        assert as_markdown(loaded.plan, loaded.cell, table)
        assert table_as_json(loaded.plan, loaded.cell, table)
        canopen = canopen_of(loaded.plan)
        if canopen is not None:
            cell = loaded.plan.cell
            assert eds_text(objects_of(canopen, cell), sheet_of(canopen, cell)).isascii()
    assert time.perf_counter() - started < SLOW
    return loaded


def drop_bytes(chance: random.Random, data: bytes) -> bytes:
    start = chance.randrange(len(data))
    return data[:start] + data[start + chance.randint(1, 20) :]


def insert_bytes(chance: random.Random, data: bytes) -> bytes:
    start = chance.randrange(len(data))
    piece = bytes(
        chance.choice(b" \t\n:{}[],'\"#&*!|>-%@`0123456789.xeE~\x00\x1b\x85\xff\xc3")
        for _ in range(chance.randint(1, 6))
    )
    return data[:start] + piece + data[start:]


def swap_words(chance: random.Random, data: bytes) -> bytes:
    words = data.split(b" ")
    one, other = chance.randrange(len(words)), chance.randrange(len(words))
    words[one], words[other] = words[other], words[one]
    return b" ".join(words)


def repeat_line(chance: random.Random, data: bytes) -> bytes:
    lines = data.split(b"\n")
    lines.insert(chance.randrange(len(lines)), chance.choice(lines))
    return b"\n".join(lines)


def change_number(chance: random.Random, data: bytes) -> bytes:
    digits = [index for index, byte in enumerate(data) if 48 <= byte <= 57]
    if not digits:
        return data
    index = chance.choice(digits)
    number = chance.choice(
        [
            b"0",
            b"-1",
            b"65535",
            b"65536",
            b"1e999",
            b"9" * 400,
            b"0x10",
            b"0.5",
            b"nan",
            b".inf",
            b"1_0",
            b"..",
            b"''",
        ]
    )
    return data[:index] + number + data[index + 1 :]


CHANGES: list[Change] = [drop_bytes, insert_bytes, swap_words, repeat_line, change_number]


@settings(max_examples=150)
@given(SEED)
def test_mutated_text(seed: int) -> None:
    """Shipped mappings and rule examples with a few bytes, words, lines or numbers changed."""
    chance = random.Random(seed)
    data = chance.choice(SEEDS).read_bytes()
    for _ in range(chance.randint(1, 4)):
        data = chance.choice(CHANGES)(chance, data) or b"\n"
    examine(data)


ODD_VALUES: list[Tree] = [
    None, True, False, 0, -1, 1, 15, 16, 65535, 65536, 10**30, 0.5, -0.0, 1e308, "", "none", "any", "hold", "clear",
    "exception", "0.16", "40001", "input_int_register_0..23", "output_double_register_0..47", "actual_TCP_pose",
    "actual_TCP_pose[0..5]", "actual_digital_input_bits.0..17", "input_bit_registers0_to_31", "runtime_state",
    "standard_digital_output.3", "speed_slider_fraction", "1s", "5", "::1", "0.0.0.0/0", "::/0", "192.0.2.20",
    "plc", "motion", [], {}, [[]], {"": None}, ["plc", "plc"], {"holding": 3}, {"coil": 0, "holding": 1},
    {"holding": "5.3", "type": "float64", "scale": 0.001}, {"input": 7, "type": "bool", "order": "DCBA"},
    [{"holding": 9, "type": "uint64", "scale": 1e-300, "offset": 1e300}], [0, 1], [1, 0], [0.5, 0.5],
]  # fmt: skip
KEYS = [
    "gatewayd", "cell", "robot", "modbus", "writers", "groups", "variables", "host", "series", "version", "frequency",
    "stale_after", "watchdog", "field", "requires", "listen", "unit", "allow", "timeout", "owner", "lease", "takeover",
    "group", "limits", "clamp", "on_release", "on_stale", "type", "order", "scale", "offset", "holding", "input",
    "coil", "discrete", "comment", "x",
]  # fmt: skip


def places(tree: Tree, path: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    """The paths of all values."""
    items = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    return [path, *(inner for key, value in items for inner in places(value, (*path, key)))]


def flow(tree: Tree) -> str:
    """The tree as YAML flow text; every text in quotes but addresses and the like, which must stay plain."""
    if isinstance(tree, dict):
        return "{" + ", ".join(f"{flow(str(key))}: {flow(value)}" for key, value in tree.items()) + "}"
    if isinstance(tree, list):
        return "[" + ", ".join(map(flow, tree)) + "]"
    if isinstance(tree, str):
        return "'" + tree.replace("'", "''") + "'"
    if isinstance(tree, bool) or tree is None:
        return {None: "null", True: "true", False: "false"}[tree]
    return str(getattr(tree, "text", tree))


def parent_of(tree: Tree, path: tuple[str | int, ...]) -> Tree:
    for step in path[:-1]:
        tree = tree[step]
    return tree


@settings(max_examples=60)
@given(SEED)
def test_mutated_trees(seed: int) -> None:
    """Valid YAML whose values were removed, exchanged, renamed or replaced by odd ones."""
    chance = random.Random(seed)
    root = parse(chance.choice(SEEDS[:3]).read_bytes(), "cell.yaml").root
    assert root is not None
    tree = plain(root)
    for _ in range(chance.randint(1, 6)):
        path = chance.choice([place for place in places(tree) if place])
        parent, step = parent_of(tree, path), path[-1]
        match chance.randrange(4):
            case 0:
                del parent[step]
            case 1:
                parent[step] = chance.choice(ODD_VALUES)
            case 2:
                other = chance.choice([place for place in places(tree) if place])
                value = parent_of(tree, other)[other[-1]]
                parent[step] = plain_copy(value)
            case _ if isinstance(parent, dict):
                parent[chance.choice(KEYS)] = parent.pop(step)
        if not any(places(tree)):
            break
    examine(flow(tree).encode())


def plain_copy(tree: Tree) -> Tree:
    """A copy without shared parts, so that no tree holds itself."""
    if isinstance(tree, dict):
        return {key: plain_copy(value) for key, value in tree.items()}
    return [plain_copy(value) for value in tree] if isinstance(tree, list) else tree


@settings(max_examples=75)
@given(SEED)
def test_mutated_plants(seed: int) -> None:
    """Several mutated files together: what they share is judged without a stumble."""
    chance = random.Random(seed)
    files = [
        (f"{index}.yaml", change_number(chance, chance.choice(SEEDS).read_bytes()))
        for index in range(chance.randint(2, 4))
    ]
    for one in load_together(files):
        assert all(finding.position.file == one.name for finding in one.diagnostics)


@settings(max_examples=150)
@given(st.binary(max_size=300))
def test_any_bytes(data: bytes) -> None:
    """Bytes that never were a mapping."""
    examine(data)


@settings(max_examples=150)
@given(st.text(max_size=200))
def test_any_text_in_a_place_of_a_value(text: str) -> None:
    """Any text as a name, a reference, an address and a comment."""
    quoted = "'" + text.replace("'", "''") + "'"
    examine(
        f"gatewayd: 1\ncell: {quoted}\nrobot: {{host: {quoted}}}\nvariables:\n"
        f"  {quoted}: {{robot: {quoted}, modbus: {quoted}, comment: {quoted}, owner: [{quoted}]}}\n".encode(
            "utf-8", "surrogatepass"
        )
    )


HUGE = {
    "brackets": b"[" * 100_000,
    "braces": b"{a: " * 50_000,
    "indentation": b"".join(b" " * depth + b"a:\n" for depth in range(500)),
    "one long line": b"cell: " + b"x" * 900_000,
    "aliases": b"a: &a [1]\nb: [" + b"*a, " * 50_000 + b"]\n",
    "anchors that grow": b"".join(f"a{n}: &a{n} [*a{n - 1}, *a{n - 1}]\n".encode() for n in range(1, 200)),
    "many keys": b"".join(f"k{n}: 1\n".encode() for n in range(5_000)),
    "many variables": b"gatewayd: 1\ncell: a\nrobot: {host: a}\nmodbus: {}\nvariables:\n"
    + b"".join(f" v{n}: {{robot: output_double_register_0..47, modbus: 0}}\n".encode() for n in range(300)),
    "many networks": b"gatewayd: 1\ncell: a\nrobot: {host: a}\nwriters: {plc: {modbus: ["
    + b", ".join(f"10.{n // 250}.{n % 250}.0/24".encode() for n in range(2_000))
    + b"]}, hmi: {modbus: 198.51.100.0/24}}\nvariables: {a: {robot: input_int_register_0}}\n",
    "beyond the limit": b"#" * 1_100_000,
    "a wide range": b"gatewayd: 1\ncell: a\nrobot: {host: a}\nvariables: {a: {robot: output_int_register_0..9999}}\n",
}


TINY, GREAT = "0." + "0" * 306 + "1", "9" * 300 + ".5"


@pytest.mark.parametrize("number", ["0", TINY, "0." + "0" * 320 + "1", GREAT, f"-{GREAT}"])
@pytest.mark.parametrize("kind", ["int16", "uint64", "float32", "float64", "bool"])
@pytest.mark.parametrize("robot", ["output_int_register_0", "input_double_register_0"])
def test_numbers_at_the_ends_of_arithmetic(number: str, kind: str, robot: str) -> None:
    """What is next to nothing or next to infinity divides and multiplies without a stumble."""
    head = "gatewayd: 1\ncell: a\nmodbus: {}\nwriters: {plc: {modbus: 127.0.0.1}}\n"
    controllers = ("robot: {host: a}", f"robot: {{host: a, frequency: {number}, stale_after: 1s}}")
    scalings = (f"scale: {number}", f"offset: {number}", f"scale: {TINY}, offset: {number}")
    policies = (
        "limits: [0, 1]",
        f"limits: [-{GREAT}, {GREAT}]",
        f"on_stale: {number}",
        f"on_release: {number}",
    )
    for controller, scaling, policy in product(controllers, scalings, policies):
        place = f"{{holding: 0, type: {kind}, {scaling}}}"
        variable = f"{{robot: {robot}, modbus: {place}, {policy}}}"
        examine(f"{head}{controller}\nvariables: {{a: {variable}}}\n".encode())


@pytest.mark.parametrize("data", HUGE.values(), ids=HUGE.keys())
def test_huge_files_end_in_bounded_time(data: bytes) -> None:
    """Depth, length and number are bounded."""
    started = time.perf_counter()
    loaded = load(data, "cell.yaml")
    assert loaded.diagnostics
    assert time.perf_counter() - started < 20

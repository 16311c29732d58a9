"""The one door: bytes in; findings, and a plan where there is no error, out."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gatewayd.core.definition import Direction
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.mapping.diagnostics import Severity
from gatewayd.mapping.loader import Loaded, load, load_together, read_bytes
from gatewayd.mapping.source import MAX_BYTES
from gatewayd.rtde.fields import INPUTS, OUTPUTS

MAPPINGS = Path(__file__).parents[2] / "mappings"
GOOD = {path.name: path.read_bytes() for path in sorted(MAPPINGS.glob("*.yaml"))}
MINIMAL = b"gatewayd: 1\ncell: c\nrobot: {host: r}\nvariables: {a: {robot: robot_mode}}\n"


def has_errors(loaded: Loaded) -> bool:
    return any(finding.severity is Severity.ERROR for finding in loaded.diagnostics)


def test_smallest_mapping_has_a_plan() -> None:
    loaded = load(MINIMAL, "small.yaml")
    assert not has_errors(loaded)
    assert loaded.plan is not None
    assert (loaded.plan.source, loaded.plan.cell.name) == ("small.yaml", "c")
    assert loaded.lines[1] == "cell: c"


def test_a_plan_exists_only_without_errors() -> None:
    """Findings of all stages come in one pass, from top to bottom."""
    text = MINIMAL.replace(b"cell: c", b"cell: C") + b"  # \nextra: 1\n"
    text = text.replace(b"robot_mode", b"robot_mod")
    loaded = load(text, "f")
    assert loaded.plan is None
    lines = [finding.position.line for finding in loaded.diagnostics]
    assert lines == sorted(lines)
    assert {2, 4, 6} <= set(lines)


def test_files_loaded_together_keep_their_own_findings() -> None:
    first, second = load_together([("a.yaml", MINIMAL), ("b.yaml", b"[")])
    assert first.plan is not None
    assert second.plan is None
    assert {finding.position.file for finding in second.diagnostics} == {"b.yaml"}


def test_a_file_named_twice_has_each_finding_once() -> None:
    first, second = load_together([("a.yaml", b"["), ("a.yaml", b"[")])
    assert len(first.diagnostics) == len(second.diagnostics) == 1


def test_cells_that_share_a_listener_are_checked_against_each_other() -> None:
    """Equal units on one listener cannot both be served; each file is fine by itself."""
    text = MINIMAL.replace(b"variables", b"modbus: {listen: 127.0.0.1:1502}\nvariables")
    assert load(text, "a.yaml").plan is not None
    assert any(found.plan is None for found in load_together([("a.yaml", text), ("b.yaml", text)]))


def test_reading_stops_at_the_limit(tmp_path: Path) -> None:
    """A device or a log file named by mistake does not fill the memory."""
    path = tmp_path / "big.yaml"
    path.write_bytes(b"#" * (MAX_BYTES + 10))
    data = read_bytes(path)
    assert len(data) == MAX_BYTES + 1
    assert [finding.rule.slug for finding in load(data, str(path)).diagnostics] == ["too-large"]


@given(st.binary(max_size=200))
def test_no_bytes_raise(data: bytes) -> None:
    """Any bytes give a plan or an error, and never an exception."""
    loaded = load(data, "f")
    assert (loaded.plan is None) == has_errors(loaded)


SNIPPETS = b"""0 -1 0.16 65535 65536 400001 60000 1e9 .inf 0x10 ~ [] {} any plc none hold exception true 5s 0ms bit bool
uint64 float32 CDAB 198.51.100.0/24 0.0.0.0:1 '[::1]:1' input_bit_register_0..127 output_double_register_0..47 actual_q
'actual_q[9]' robot_mode.3 timestamp * & ! | > : - , ' " #""".split()


@st.composite
def mutated(draw: st.DrawFn) -> bytes:
    """A shipped mapping with words replaced, lines doubled, dropped or moved, and bytes changed."""
    data = draw(st.sampled_from(sorted(GOOD.values())))
    for _ in range(draw(st.integers(1, 4))):
        match draw(st.integers(0, 3)):
            case 0:
                words = data.split(b" ")
                words[draw(st.integers(0, len(words) - 1))] = draw(st.sampled_from(SNIPPETS))
                data = b" ".join(words)
            case 1:
                lines = data.splitlines()
                line = draw(st.integers(0, len(lines) - 1))
                data = b"\n".join(
                    lines[:line] + lines[line + 1 :] + draw(st.sampled_from([[], [lines[line]]]))
                )
            case 2:
                at = draw(st.integers(0, len(data) - 1))
                data = data[:at] + draw(st.binary(max_size=2)) + data[at + 1 :]
            case _:
                data = data[: draw(st.integers(0, len(data)))]
        data = data or b" "
    return data


@settings(max_examples=150)
@given(mutated())
def test_no_mutation_of_a_good_file_raises(data: bytes) -> None:
    """Nearly right files reach the rules and the compiler: findings, never a traceback."""
    loaded = load(data, "f")
    assert (loaded.plan is None) == has_errors(loaded)
    for finding in loaded.diagnostics:
        assert finding.message
        assert finding.position.line >= 1
        assert finding.position.column >= 1


@pytest.mark.parametrize("name", GOOD)
def test_loading_is_deterministic(name: str) -> None:
    path = str(MAPPINGS / name)  # data sheets lie beside the mapping
    assert load(GOOD[name], path).plan == load(GOOD[name], path).plan


TYPES = [
    "",
    ", type: int16",
    ", type: uint64",
    ", type: float32, order: DCBA",
    ", scale: 0.01, offset: -3",
    ", type: bool",
]
FIELDS = [
    *sorted(INPUTS),
    *sorted(OUTPUTS),
    "input_bit_register_7",
    "output_bit_register_0..63",
    "robot_mode.3",
]
OWNERS = [
    "",
    ", owner: plc",
    ", owner: [plc, hmi], lease: 3s",
    ", owner: any",
    ", group: g",
    ", on_release: hold",
]
lines = st.tuples(
    st.sampled_from(FIELDS),
    st.sampled_from(["holding", "input", "coil", "discrete"]),
    st.integers(0, 5000),
    st.sampled_from(TYPES),
    st.sampled_from(OWNERS),
)


@given(st.lists(lines, min_size=1, max_size=6))
def test_plans_are_consistent(made: list[tuple[str, str, int, str, str]]) -> None:
    """Whatever passes the rules compiles, and all indices of the plan lead somewhere."""
    text = "gatewayd: 1\ncell: c\nrobot: {host: r}\nmodbus: {listen: 127.0.0.1:502}\n"
    text += "writers: {plc: {modbus: 127.0.0.1}, hmi: {modbus: 127.0.0.2}}\ngroups: {g: {owner: plc}}\nvariables:\n"
    for number, (field, area, address, kind, some_owner) in enumerate(made):
        owner = some_owner if field in INPUTS or field.startswith("input_") else ""
        text += f"  v{number}: {{robot: {field}, modbus: {{{area}: {address}{kind}}}{owner}}}\n"
    loaded = load(text.encode(), "f")
    plan = loaded.plan
    assert (plan is None) == has_errors(loaded)
    if plan is None:
        return
    cell = plan.cell
    for index, lock in enumerate(cell.locks):
        assert lock.owners
        assert all(cell.variables[member].lock == index for member in lock.members)
        assert all(owner < len(cell.writers) for owner in lock.owners)
    for variable in cell.variables:
        assert (variable.lock is not None) == (variable.direction is Direction.INPUT)
    assert plan.of(ModbusPlan)
    for placement in plan.the(ModbusPlan).placements:
        variable = cell.variables[placement.variable]
        if placement.codec is not None:
            assert len(placement.codec.encode(variable.kind.zero)) == 2 * placement.words


def test_a_file_costs_the_kinds_that_it_speaks_of(tmp_path: Path) -> None:
    """A start waits for what is imported: a cell without CANopen waits for none of it."""
    mapping = tmp_path / "cell.yaml"
    mapping.write_text((MAPPINGS / "small-cell.yaml").read_text())
    program = f"""
import sys
from gatewayd.mapping.worker import compile_files
assert compile_files([{str(mapping)!r}]).plans
unused = ("gatewayd.canopen.dictionary", "gatewayd.links.canopen_node.plan", "gatewayd.links.canopen_node.rules",
    "gatewayd.rtde.messages", "importlib.resources")
print(*(name for name in sys.modules if name.startswith(unused)))
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []

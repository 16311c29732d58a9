"""What travels between the process that compiles and the one that serves arrives as it was."""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest

from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.mapping.compiled import Compiled, CompiledFile, Unreadable
from gatewayd.mapping.loader import load
from gatewayd.modbus.codec import ORDERS, TYPES

MAPPINGS = sorted((Path(__file__).parents[2] / "mappings").glob("*.yaml"))
HEAD = "gatewayd: 1\ncell: all\nrobot: {host: 192.0.2.1}\nmodbus: {listen: '127.0.0.1:1502'}\nvariables:\n"


def compiled(data: bytes, name: str) -> CompiledFile:
    loaded = load(data, name)
    return CompiledFile(loaded.name, loaded.diagnostics, loaded.plan)


def travelled(one: Compiled) -> Compiled:
    found = pickle.loads(pickle.dumps(one, pickle.HIGHEST_PROTOCOL))  # noqa: S301 - our own
    assert isinstance(found, Compiled)
    return found


@pytest.mark.parametrize("path", MAPPINGS, ids=lambda path: path.stem)
def test_shipped_mappings_arrive_as_they_were(path: Path) -> None:
    sent = Compiled((compiled(path.read_bytes(), str(path)),))
    assert sent.plans
    assert travelled(sent) == sent


def test_every_kind_of_number_arrives_with_functions_that_do_the_same() -> None:
    lines = [
        f"  v{n}: {{robot: 'output_double_register_{n % 24}', "
        f"modbus: {{holding: {4 * n}{'.low' * TYPES[name].is_byte}, type: {name}, order: {order}{scale}}}}}\n"
        for n, (name, order, scale) in enumerate(
            (name, order, scale)
            for name in TYPES
            if name != "bool"
            for order in (ORDERS if TYPES[name].words > 1 else ("ABCD", "BADC"))
            for scale in ("", ", scale: 0.5, offset: 3")
        )
    ]
    sent = Compiled((compiled((HEAD + "".join(lines)).encode(), "all.yaml"),))
    assert not sent.files[0].errors
    for here, there in zip(sent.plans, travelled(sent).plans, strict=True):
        assert here.the(ModbusPlan) is not None
        assert there.the(ModbusPlan) is not None
        for one, other in zip(here.the(ModbusPlan).placements, there.the(ModbusPlan).placements, strict=True):
            assert one.codec is not None
            assert other.codec is not None
            raw = one.codec.encode(7.5)
            assert other.codec.encode(7.5) == raw
            assert other.codec.decode(raw) == one.codec.decode(raw)
            assert other.codec.struct_code == one.codec.struct_code


def test_findings_arrive_whole() -> None:
    sent = Compiled(
        (
            compiled(
                b"gatewayd: 1\ncell: x\nvariables: {a: {robot: input_int_registre_0, modbus: 0}}\n", "x.yaml"
            ),
        ),
        (Unreadable("y.yaml", "Permission denied"),),
    )
    found = travelled(sent)
    assert found == sent
    assert found.plans == ()
    assert found.files[0].errors
    assert all(str(one.position).startswith("x.yaml:") for one in found.files[0].errors)

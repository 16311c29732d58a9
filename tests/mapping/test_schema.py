"""The JSON Schema that editors complete from."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jsonschema
import pytest

from gatewayd.mapping.schema import mapping_schema, schema_text
from gatewayd.mapping.source import parse
from tests.mapping.values import plain

MAPPINGS = Path(__file__).parents[2] / "mappings"
VALIDATOR = jsonschema.Draft202012Validator(mapping_schema())


def data(text: str) -> Any:
    source = parse(text.encode(), "f")
    assert source.root is not None, source.findings
    return plain(source.root)


def test_shipped_schema_is_current() -> None:
    """`python -m gatewayd.mapping.schema > mappings/schema.json` renews it."""
    assert (MAPPINGS / "schema.json").read_text() == schema_text()


def test_schema_is_a_schema() -> None:
    jsonschema.Draft202012Validator.check_schema(mapping_schema())


@pytest.mark.parametrize("path", sorted(MAPPINGS.glob("*.yaml")), ids=lambda path: path.name)
def test_shipped_mappings_follow_it(path: Path) -> None:
    VALIDATOR.validate(data(path.read_text()))


HEAD = "gatewayd: 1\ncell: c\nrobot: {host: r}\n"


@pytest.mark.parametrize(
    "line",
    [
        "a: {robot: x, modbus: 0.10, owner: any, lease: 2s, on_release: hold}",
        "a: {robot: x, modbus: [1, '2.3', {coil: 4}], owner: [plc, hmi], on_release: 3.5}",
        "a: {robot: x_0..23, modbus: {holding: 7, type: int16, scale: 0.1, order: CDAB}, limits: [0, 1]}",
        "a: {robot: 'x[0]', on_stale: exception, lease: none}",
        "a: {robot: x, canopen: auto}",
        "a: {robot: x, canopen: {pdo: forces, type: REAL32}}",
    ],
)
def test_schema_takes_what_check_takes(line: str) -> None:
    VALIDATOR.validate(data(f"{HEAD}variables:\n  {line}"))


@pytest.mark.parametrize(
    "line",
    [
        "a: {modbus: 1}",
        "a: {robot: x, on_relase: hold}",
        "a: {robot: x, modbus: {holding: 7, coil: 3}}",
        "a: {robot: x, modbus: {type: int16}}",
        "a: {robot: x, modbus: {holding: 7, type: int12}}",
        "a: {robot: x, lease: 5}",
        "a: {robot: x, limits: [1]}",
        "a: {robot: x, on_release: exception}",
        "9a: {robot: x}",
        "a: {robot: x, canopen: automatic}",
        "a: {robot: x, canopen: {type: FLOAT}}",
    ],
)
def test_schema_marks_common_mistakes(line: str) -> None:
    """An editor underlines them before `check` is run."""
    assert not VALIDATOR.is_valid(data(f"{HEAD}variables:\n  {line}"))


NODE = "canopen: {channel: can0, bitrate: 500000, node: 16"


@pytest.mark.parametrize(
    "text",
    [
        f"{NODE}, pdos: {{p: {{cob_id: 0x1C0, transmission: sync, variables: [a, 'b[0..3]']}}}}}}",
        f"{NODE}, cob_ids: {{tpdo: [0x680, 0x690..0x69F]}}, heartbeat: none}}",
        "writers: {line: {canopen: any, node: 1, heartbeat: 1s}}",
    ],
)
def test_schema_takes_the_canopen_side(text: str) -> None:
    VALIDATOR.validate(data(f"{HEAD}variables: {{}}\n{text}"))


@pytest.mark.parametrize(
    "text",
    [
        "canopen: {channel: can0, node: 16}",
        f"{NODE}, pdos: {{p: {{cob_id: 1C0h}}}}}}",
        f"{NODE}, pdo: {{transmission: cyclic}}}}",
        "writers: {line: {timeout: 1s}}",
    ],
)
def test_schema_marks_mistakes_of_the_canopen_side(text: str) -> None:
    assert not VALIDATOR.is_valid(data(f"{HEAD}variables: {{}}\n{text}"))


def test_every_property_is_described_for_the_editor() -> None:
    schema = mapping_schema()
    for section in (schema, *schema["$defs"].values()):
        assert all("description" in value for value in section["properties"].values())

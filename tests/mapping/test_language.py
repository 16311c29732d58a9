"""The whole language, put together from the kinds of links."""

from __future__ import annotations

import pytest

from gatewayd.links.canopen_node.sections import CanopenWriter
from gatewayd.links.modbus_server.sections import ModbusWriter
from gatewayd.mapping.language import FILE, VARIABLE, WRITER
from gatewayd.mapping.typed import Invalid


def test_keys_come_in_the_order_of_the_kinds() -> None:
    """Hints, the schema and the reference list them so."""
    assert list(FILE.model_fields) == [
        "gatewayd", "cell", "robot", "modbus", "canopen", "devices", "mqtt", "standby", "writers", "groups",
        "variables", "tests",
    ]  # fmt: skip
    assert list(VARIABLE.model_fields) == [
        "robot", "dashboard", "modbus", "canopen", "device", "mqtt", "owner", "takeover", "lease", "group", "limits",
        "clamp", "on_release", "on_stale", "valid", "deadband", "unit", "comment",
    ]  # fmt: skip
    assert list(WRITER.model_fields) == [
        "modbus", "role", "canopen", "pdos", "node", "heartbeat", "guarding", "device", "mqtt", "timeout",
        "timeout_counts", "grace",
    ]  # fmt: skip


def test_a_kind_finds_its_own_keys() -> None:
    writer = WRITER.model_validate({"modbus": "192.0.2.1", "canopen": "rpdo"})
    assert [str(network) for network in writer.by(ModbusWriter).modbus] == ["192.0.2.1/32"]
    assert writer.by(CanopenWriter).by_rpdo


def test_a_writer_needs_some_link() -> None:
    with pytest.raises(Invalid) as caught:
        WRITER.model_validate({"timeout": "1s"})
    (mistake,) = caught.value.mistakes
    assert mistake.kind == "missing-key"
    assert mistake.context == {
        "message": "a writer needs the key `modbus`, `canopen`, `device` or `mqtt`, by which it is known",
        "hint": "add for example `modbus: 192.0.2.20`, `canopen: rpdo`, `device: island` or `mqtt: set`",
    }

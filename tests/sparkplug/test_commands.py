"""What commands want, and what is refused of them. Nothing in them raises."""

from __future__ import annotations

import random
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.sparkplug.actions import CommandReceived, CommandRefused
from gatewayd.sparkplug.commands import ReadCommand, read_command
from gatewayd.sparkplug.datatypes import MetricType
from gatewayd.sparkplug.declarations import DeviceDeclaration, MetricDeclaration
from gatewayd.sparkplug.roster import Roster, RosterDevice

schema = pytest.importorskip("tests.sparkplug.schema")

ROSTER = Roster(
    [MetricDeclaration("Node/x", MetricType.INT32, is_writable=True)],
    [
        DeviceDeclaration(
            "d",
            (
                MetricDeclaration("start", MetricType.BOOLEAN, is_writable=True),
                MetricDeclaration("part", MetricType.INT16, is_writable=True),
                MetricDeclaration("speed", MetricType.DOUBLE),
            ),
        )
    ],
)
DEVICE = ROSTER.devices["d"]


def read(*metrics: dict[str, Any], device: RosterDevice = DEVICE) -> ReadCommand:
    payload = schema.ForeignPayload(timestamp=5)
    for fields in metrics:
        payload.metrics.add(**fields)
    return read_command(device, payload.SerializeToString())


def test_values_by_name_and_by_alias() -> None:
    outcome = read({"name": "start", "boolean_value": True}, {"alias": 3, "int_value": 0xFFFF_FFF9}).outcome
    assert outcome == CommandReceived("d", (("start", True), ("part", -7)), 5)


def test_name_with_its_own_alias() -> None:
    outcome = read({"name": "part", "alias": 3, "int_value": 7, "datatype": 3}).outcome
    assert outcome == CommandReceived("d", (("part", 7),), 5)


def test_the_last_value_of_a_metric_counts() -> None:
    outcome = read({"name": "part", "int_value": 7}, {"alias": 3, "int_value": 8}).outcome
    assert outcome == CommandReceived("d", (("part", 8),), 5)


@pytest.mark.parametrize(
    "fields, words",
    [
        ({"name": "nothing", "int_value": 1}, "'nothing': there is no such metric"),
        ({"alias": 99, "int_value": 1}, "alias 99: there is no such metric"),
        ({"int_value": 1}, "without name and alias: there is no such metric"),
        ({"name": "part", "alias": 2, "int_value": 1}, "'part': its alias 2 is that of another metric"),
        ({"name": "speed", "double_value": 1.0}, "'speed': is not writable"),
        ({"name": "part", "int_value": 1, "is_historical": True}, "is historical"),
        ({"name": "part", "is_null": True}, "has no value"),
        ({"name": "part"}, "has no value"),
        ({"name": "part", "int_value": 40_000_000}, "40000000 is beyond the type Int16"),
        ({"name": "part", "string_value": "7"}, "a string_value is no value of the type Int16"),
        ({"name": "start", "datatype": 11, "int_value": 1}, "a int_value is no value of the type Boolean"),
        ({"name": "part", "datatype": 99, "int_value": 1}, "no data type 99"),
        ({"name": "x" * 500, "int_value": 1}, "'" + "x" * 80 + "': there is"),
    ],
)
def test_one_fault_refuses_the_whole(fields: dict[str, Any], words: str) -> None:
    outcome = read({"name": "start", "boolean_value": True}, fields).outcome
    assert isinstance(outcome, CommandRefused)
    assert words in outcome.reason
    assert outcome.names[0] == "start"


def test_a_command_is_bounded() -> None:
    outcome = read_command(DEVICE, bytes(8193)).outcome
    assert outcome == CommandRefused("d", (), "the payload has 8193 bytes; at most 8192 are read")
    outcome = read(*[{"name": "part", "int_value": 1}] * 257).outcome
    assert outcome == CommandRefused("d", (), "the payload has over 256 metrics")


def test_properties_of_a_command_are_not_looked_at() -> None:
    payload = schema.ForeignPayload()
    payload.metrics.add(name="part", int_value=1).properties.keys.append("without a value")
    outcome = read_command(DEVICE, payload.SerializeToString()).outcome
    assert outcome == CommandReceived("d", (("part", 1),), None)


def test_a_command_that_names_nothing_is_refused() -> None:
    assert read().outcome == CommandRefused("d", (), "names no metric")
    assert read(device=ROSTER.node).outcome == CommandRefused("", (), "names no metric")


def test_bytes_that_are_no_payload_are_refused() -> None:
    outcome = read_command(DEVICE, b'{"part": 1}').outcome
    assert outcome == CommandRefused("d", (), "the payload ends too early; missing bytes: 104")


REBIRTH = {"name": "Node Control/Rebirth", "boolean_value": True}


def test_a_rebirth_alone_and_among_values() -> None:
    assert read(REBIRTH, device=ROSTER.node) == ReadCommand(wants_rebirth=True)
    both = read({"name": "Node/x", "int_value": 1}, REBIRTH, device=ROSTER.node)
    assert both == ReadCommand(True, CommandReceived("", (("Node/x", 1),), 5))


@pytest.mark.parametrize("value", [{"boolean_value": False}, {"int_value": 1}, {}])
def test_only_true_asks_for_a_rebirth(value: dict[str, Any]) -> None:
    found = read({"name": "Node Control/Rebirth", **value}, device=ROSTER.node)
    assert found == ReadCommand(outcome=CommandRefused("", (), "Node Control/Rebirth is not true"))


def test_a_device_has_no_rebirth() -> None:
    found = read(REBIRTH)
    assert not found.wants_rebirth
    assert isinstance(found.outcome, CommandRefused)


@given(st.binary(max_size=100))
def test_any_bytes_are_a_command_or_refused(data: bytes) -> None:
    assert read_command(DEVICE, data).outcome is not None


def test_mutated_commands_are_commands_or_refused() -> None:
    chance = random.Random(5)
    payload = schema.ForeignPayload(timestamp=5, seq=3)
    payload.metrics.add(name="start", boolean_value=True)
    payload.metrics.add(alias=3, int_value=7, datatype=2)
    payload.metrics.add(**REBIRTH)
    whole = payload.SerializeToString()
    refused = 0
    for _ in range(3000):
        data = bytearray(whole)
        for _ in range(chance.randint(1, 3)):
            data[chance.randrange(len(data))] = chance.randrange(256)
        found = read_command(
            chance.choice((DEVICE, ROSTER.node)), bytes(data[: chance.randint(1, len(data))])
        )
        refused += isinstance(found.outcome, CommandRefused)
        if isinstance(found.outcome, CommandReceived):
            assert all(isinstance(value, bool | int) for _, value in found.outcome.values)
    assert 0 < refused < 3000

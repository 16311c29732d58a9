"""Which object a variable has, and which PDO carries it."""

from __future__ import annotations

import pytest

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.manager.plan import ManagedPdo, PdoObject
from gatewayd.links.devices.canopen.expand import DeviceLayout, lay_out, object_of
from gatewayd.links.devices.expand import devices_of
from gatewayd.links.devices.sections import DeviceSpec
from gatewayd.mapping.loader import load
from tests.links.devices.canopen.cells import expanded, line, text

POSITION = PdoObject(0x6004, 0, 32, CanType.UNSIGNED32)
SPEED = PdoObject(0x6030, 0, 16, CanType.INTEGER16)
SWITCH = PdoObject(0x6010, 0, 1, CanType.BOOLEAN)


def layout(variables: str, more: str = "") -> DeviceLayout:
    """The PDOs of its encoder."""
    cell = expanded(variables, more)
    return lay_out(cell.document, cell.document.parts(DeviceSpec)["encoder"], devices_of(cell).of("encoder"))


def test_pdo_of_the_data_sheet_is_taken_as_it_is() -> None:
    found = layout(
        line("a", "input_int_register_0", "object: 0x6004")
        + line("b", "input_int_register_1", "object: 0x6030")
    )
    assert found.pdos == (ManagedPdo(1, True, 0x185, (POSITION,), transmission=254, no_remote=True),)
    assert found.carried == {0: (0, 0)}


def test_pdo_that_the_gateway_lays_out() -> None:
    """In the order of the file; its COB-ID is that of the data sheet although it is switched off there."""
    found = layout(
        line("a", "input_int_register_0", "object: 0x6030, pdo: 2")
        + line("b", "input_bit_register_1", "object: 0x6010, pdo: 2")
        + line("c", "input_int_register_2", "object: 0x6030, pdo: 2"),
        ", inhibit: 5ms, event: 50ms",
    )
    (pdo,) = found.pdos
    assert pdo == ManagedPdo(
        2, True, 0x285, (SPEED, SWITCH), True, transmission=255, inhibit=50, event=50, no_remote=True
    )
    assert found.carried == {0: (0, 0), 1: (0, 1), 2: (0, 0)}


def test_both_directions_and_sync() -> None:
    found = layout(
        line("a", "input_int_register_0", "object: 0x6004, pdo: 1")
        + line("b", "output_int_register_1", "object: 0x6200, sub: 1, pdo: 1"),
        ", transmission: sync, inhibit: 5ms",
    )
    tpdo, rpdo = found.pdos
    assert (tpdo.transmission, tpdo.inhibit, tpdo.cob_id) == (1, 50, 0x185)
    assert (rpdo.transmission, rpdo.inhibit, rpdo.spacing, rpdo.cob_id) == (1, None, 0.005, 0x205)


def test_sdo_where_it_is_wanted_or_nothing_else_has_the_object() -> None:
    found = layout(
        line("a", "input_int_register_0", "object: 0x6004, pdo: none")
        + line("b", "input_int_register_1", "object: 0x2000")
    )
    assert (found.pdos, found.carried) == ((), {})


def test_family_goes_from_sub_index_to_sub_index() -> None:
    cell = expanded(line("a", "'input_int_register_0..1'", "object: 0x6000, sub: 1"))
    found = [object_of(place) for place in devices_of(cell).places]
    assert [(each.index, each.subindex, each.type) for each in found if each is not None] == [
        (0x6000, 1, CanType.UNSIGNED8),
        (0x6000, 2, CanType.UNSIGNED8),
    ]


@pytest.mark.parametrize(
    "place, rule",
    [
        ("object: 0x2001", "GW832"),
        ("object: 0x6004, type: int16", "GW832"),
        ("object: 0x2002", "GW834"),
        ("object: 0x6000, sub: 9", "GW831"),
        ("object: 0x6010, scale: 2", "GW833"),
    ],
)
def test_what_cannot_be_is_a_finding(place: str, rule: str) -> None:
    found = load(text(line("a", "input_int_register_0", place)).encode(), "press.yaml")
    assert rule in {each.rule.id for each in found.errors}
    assert found.plan is None


def test_remedy_names_the_sub_indices() -> None:
    found = load(text(line("a", "input_int_register_0", "object: 0x6000, sub: 9")).encode(), "press.yaml")
    (finding,) = [each for each in found.errors if each.rule.id == "GW831"]
    assert finding.hint == "write `sub:` with one of its sub-indices: 0, 1, 2"

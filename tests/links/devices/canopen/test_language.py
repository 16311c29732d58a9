"""From a mapping file to the plan of a CANopen device."""

from __future__ import annotations

import pickle
from pathlib import Path

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.manager.plan import ExpectedIdentity, ManagerPlan, ObjectReading, Setting
from gatewayd.canopen.sync import SyncPlan
from gatewayd.links.devices.canopen.plan import CanopenDevicePlan, ObjectPlace
from gatewayd.links.devices.canopen.sections import CanopenDeviceKeys, CanopenPlaceKeys
from gatewayd.links.devices.declaration import KIND
from gatewayd.links.devices.modbus.sections import ModbusDeviceKeys, ModbusPlaceKeys
from gatewayd.links.devices.sections import DeviceKeys, PlaceKeys
from gatewayd.links.devices.tables import TABLES
from gatewayd.mapping.loader import load
from tests.links.devices.canopen.cells import SHEET, VARIABLES, line, planned, text, the_device


def test_plan_has_all_that_the_daemon_needs() -> None:
    plan = planned()
    device = the_device(plan)
    assert device.bus == ManagerPlan("virtual", "can1", 500_000)
    assert device.node.expected == ExpectedIdentity(0x20196, 0x1F0, 0x401)
    assert (device.node.heartbeat, device.node.producer, device.node.sdo_timeout) == (9.0, 3000, 1.0)
    assert device.places == (
        ObjectPlace(0, 0x6004, 0, CanType.UNSIGNED32, (0.001, 0.0), 0, 0),
        ObjectPlace(1, 0x2000, 0, CanType.UNSIGNED16, poll=0.02),
        ObjectPlace(2, 0x6200, 1, CanType.UNSIGNED8, None, 1, 0),
        ObjectPlace(3, 0x2002, 0, CanType.UNSIGNED16),
    )
    assert device.node.readings == (
        ObjectReading(0x6004, 0, CanType.UNSIGNED32),
        ObjectReading(0x2000, 0, CanType.UNSIGNED16, 0.02),
    )
    assert pickle.loads(pickle.dumps(plan)) == plan  # noqa: S301 - our own
    assert plan.cell.fingerprint == planned().cell.fingerprint


def test_another_data_sheet_is_another_fingerprint(tmp_path: Path) -> None:
    other = tmp_path / "device.eds"
    other.write_bytes(SHEET.read_bytes().replace(b"0x401", b"0x402"))
    changed = load(text().replace(str(SHEET), str(other)).encode(), "press.yaml").plan
    assert changed is not None
    assert changed.cell.fingerprint != planned().cell.fingerprint


def test_data_sheet_lies_beside_the_mapping(tmp_path: Path) -> None:
    (tmp_path / "device.eds").write_bytes(SHEET.read_bytes())
    beside = text().replace(str(SHEET), "device.eds").encode()
    assert load(beside, str(tmp_path / "press.yaml")).plan is not None
    found = load(beside, str(tmp_path / "elsewhere" / "press.yaml"))
    assert [each.rule.id for each in found.errors] == ["GW830"]


def test_dcf_is_written_and_its_date_remembered(tmp_path: Path) -> None:
    dcf = tmp_path / "device.dcf"
    dcf.write_bytes(
        SHEET.read_bytes().replace(b"ParameterName=Preset\n", b"ParameterName=Preset\nParameterValue=7\n")
    )
    plan = load(text(more=", store: true").replace(str(SHEET), str(dcf)).encode(), "press.yaml").plan
    assert plan is not None
    node = the_device(plan).node
    assert (node.settings, node.configured, node.store) == (
        (Setting(0x2000, 0, b"\7\0"),),
        (14611, 55_800_000),
        True,
    )


def test_what_is_said_of_the_bus() -> None:
    device = the_device(planned(more=", sync: 10ms, manager: 127, manager_heartbeat: 200ms, bitrate: 250000"))
    assert device.bus == ManagerPlan(
        "virtual", "can1", 250_000, 127, 200, SyncPlan(producer=True, period=10_000)
    )


def test_device_without_a_data_sheet() -> None:
    variables = line("a", "input_int_register_0", "object: 0x6004, type: int16")
    found = load(text(variables).replace(f"eds: {SHEET}, ", "").encode(), "press.yaml")
    assert found.plan is not None
    device = the_device(found.plan)
    assert device.node.expected == ExpectedIdentity()
    assert device.places[0].type is CanType.INTEGER16


def test_time_that_pdos_are_good_for_is_at_least_that_of_the_heartbeat() -> None:
    plan = load(text(more=", lost_after: 2s", heartbeat="6s").encode(), "press.yaml").plan
    assert plan is not None
    assert the_device(plan).lost_after == 6.0


def test_families_have_no_key_of_the_same_name() -> None:
    """All of them stand in one table."""
    own = {*CanopenDeviceKeys.model_fields, *CanopenPlaceKeys.model_fields}
    others = (ModbusDeviceKeys, ModbusPlaceKeys, DeviceKeys, PlaceKeys)
    assert not own & {key for table in others for key in table.model_fields}


def test_described_in_words() -> None:
    plan = planned()
    found = KIND.describe(the_device(plan), plan.cell)
    assert found.address == "can1 node 5"
    assert found.settings["PDOs"] == "TPDO 1 185h (as it is), RPDO 1 205h (as it is)"
    assert [each.text for places in found.places.values() for each in places] == [
        "object 6004h:00 uint32 * 0.001 + 0, TPDO 1",
        "object 2000h:00 uint16, SDO every 0.02 s",
        "object 6200h:01 uint8, RPDO 1",
        "object 2002h:00 uint16, SDO, written on connect",
    ]


def test_identity_of_a_plan_follows_names_and_not_indices() -> None:
    plan = planned()
    moved = planned("  first: {robot: input_int_register_9, modbus: 0, owner: plc}\n" + VARIABLES)
    old, new = the_device(plan), the_device(moved)
    assert isinstance(new, CanopenDevicePlan)
    assert old != new
    assert old.identity(plan.cell) == new.identity(moved.cell)


def test_tables_say_what_carries_a_value() -> None:
    """A PDO, or reads by SDO every so often. An output by SDO is written when it changes."""
    found = load(text().encode(), "press.yaml").cell
    assert [row[3:] for row in TABLES.screen_table(found).rows] == [
        ("position ->", "TPDO 1"),
        ("preset ->", "0.02 s"),
        ("clamp <-", "RPDO 1"),
        ("speed <-", ""),
    ]
    (position,) = TABLES.rows(found)[0]
    assert (position["device_poll"], position["device_pdo"]) == (None, "TPDO 1")

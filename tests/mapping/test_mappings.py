"""The shipped mappings: what they promise in their comments."""

from __future__ import annotations

from pathlib import Path

import pytest

from gatewayd.core.definition import Direction
from gatewayd.links.canopen_node.plan import CanopenPlan
from gatewayd.links.devices.canopen.plan import CanopenDevicePlan
from gatewayd.links.devices.modbus.plan import ModbusDevicePlan
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.links.robot.plan import robot_of
from gatewayd.mapping.loader import Loaded, load, load_together
from gatewayd.mapping.plan import Plan
from gatewayd.modbus.areas import Area

MAPPINGS = Path(__file__).parents[2] / "mappings"
NAMES = [path.name for path in sorted(MAPPINGS.glob("*.yaml"))]


def loaded(name: str) -> Loaded:
    return load((MAPPINGS / name).read_bytes(), str(MAPPINGS / name))


def plan(name: str) -> Plan:
    found = loaded(name).plan
    assert found is not None
    return found


@pytest.mark.parametrize("name", NAMES)
def test_passes_strictly(name: str) -> None:
    """No error and no warning."""
    findings = loaded(name).diagnostics
    assert [(str(finding.position), finding.rule.slug, finding.message) for finding in findings] == []


def test_all_of_them_can_run_in_one_process() -> None:
    """`gatewayd run mappings` is a way to look at them; `check --strict` of all at once is what CI does."""
    found = load_together([(str(MAPPINGS / name), (MAPPINGS / name).read_bytes()) for name in NAMES])
    assert [finding.message for one in found for finding in one.diagnostics] == []


FINGERPRINTS = {
    "can-encoder.yaml": 0x3DB61622,
    "canopen-only.yaml": 0x5D991DFA,
    "full-image.yaml": 0xCB023DE1,
    "io-island.yaml": 0x242D0BB8,
    "rtu-gripper.yaml": 0xFA2B68A8,
    "mqtt-cell.yaml": 0x535A928D,
    "robot-program.yaml": 0xB17B003D,
    "secured-cell.yaml": 0xEBFD327A,
    "sparkplug-cell.yaml": 0xC4771DE3,
    "standby-pair.yaml": 0x9485D3DC,
    "small-cell.yaml": 0xBAD7CD02,
    "two-buses.yaml": 0x7F8C7A72,
    "two-plcs.yaml": 0x22928C89,
    "ur-native-map.yaml": 0x576C49CF,
}
"""What a PLC compares with the status block. A new key of the language must not change them; a change of what a file
says does, and belongs into the changelog."""


@pytest.mark.parametrize("name", NAMES)
def test_keeps_its_fingerprint(name: str) -> None:
    assert f"{plan(name).cell.fingerprint:08X}" == f"{FINGERPRINTS[name]:08X}"


@pytest.mark.parametrize("name", NAMES)
def test_listens_on_loopback_and_says_how_to_change_it(name: str) -> None:
    text = (MAPPINGS / name).read_text()
    assert text.startswith("# yaml-language-server: $schema=schema.json\n")
    modbus = plan(name).of(ModbusPlan).get("modbus")
    assert (modbus is None) == (name in {"can-encoder.yaml", "canopen-only.yaml", "rtu-gripper.yaml"})
    if name == "standby-pair.yaml":
        # No use on one machine, and the virtual address comes after the listener: only the plant's network may connect.
        assert modbus is not None
        assert (modbus.host, bool(modbus.allow)) == ("0.0.0.0", True)
    elif modbus is not None:
        assert modbus.host == "127.0.0.1"
        assert modbus.port > 1023
        assert ("0.0.0.0:502" if modbus.plain else "0.0.0.0:802") in text


@pytest.mark.parametrize("name", ["canopen-only.yaml", "two-buses.yaml"])
def test_names_a_bus_to_try_it_on(name: str) -> None:
    canopen = plan(name).the(CanopenPlan)
    assert canopen is not None
    assert (canopen.interface, canopen.channel) == ("socketcan", "can0")
    assert "vcan0" in (MAPPINGS / name).read_text()


def test_ready_made_files_are_there() -> None:
    assert set(NAMES) == {
        "can-encoder.yaml",
        "canopen-only.yaml",
        "full-image.yaml",
        "io-island.yaml",
        "mqtt-cell.yaml",
        "rtu-gripper.yaml",
        "robot-program.yaml",
        "secured-cell.yaml",
        "small-cell.yaml",
        "sparkplug-cell.yaml",
        "standby-pair.yaml",
        "two-buses.yaml",
        "two-plcs.yaml",
        "ur-native-map.yaml",
    }


def test_full_image_is_full() -> None:
    """64 bits, 24 integers and 24 doubles each way, bits both packed and as coils or discrete inputs."""
    found = plan("full-image.yaml")
    for direction in Direction:
        fields = [variable.field for variable in found.cell.variables if variable.direction is direction]
        side = direction.value
        assert fields.count(f"{side}_bit_registers0_to_31") == 32
        assert fields.count(f"{side}_bit_registers32_to_63") == 32
        for kind in ("int", "double"):
            assert {f"{side}_{kind}_register_{number}" for number in range(24)} <= set(fields)
        assert len(fields) == 64 + 24 + 24
    assert found.the(ModbusPlan) is not None
    areas = [placement.area for placement in found.the(ModbusPlan).placements]
    assert (areas.count(Area.COIL), areas.count(Area.DISCRETE)) == (64, 64)


@pytest.mark.parametrize(
    "name, address, bit",
    [
        ("in_bits[0]", 0, 0),
        ("in_bits[63]", 3, 15),
        ("in_ints[23]", 146, None),
        ("in_doubles[23]", 292, None),
        ("out_bits[16]", 1001, 0),
        ("out_ints[0]", 1100, None),
        ("out_doubles[23]", 1292, None),
    ],
)
def test_full_image_has_the_documented_addresses(name: str, address: int, bit: int | None) -> None:
    """The table in the file's head and in the reference; PLC programs are built on it."""
    found = plan("full-image.yaml")
    index = next(variable.number - 1 for variable in found.cell.variables if variable.name == name)
    assert found.the(ModbusPlan) is not None
    places = [
        (placement.address, placement.bit)
        for placement in found.the(ModbusPlan).placements
        if placement.variable == index and placement.area is Area.HOLDING
    ]
    assert places == [(address, bit)]


def test_canopen_only_has_the_documented_objects_and_pdos() -> None:
    """The table in the file's head: masters are configured by it."""
    canopen = plan("canopen-only.yaml").the(CanopenPlan)
    assert canopen is not None
    ends: dict[int, int] = {}
    for one in canopen.objects:
        ends[one.index] = one.subindex
    assert ends == {0x2000: 64, 0x2010: 24, 0x2030: 24, 0x2400: 64, 0x2410: 24, 0x2430: 24}
    for direction in Direction:
        pdos = [pdo for pdo in canopen.pdos if pdo.direction is direction]
        assert [pdo.number for pdo in pdos] == list(range(1, 26))
        kinds = [pdo.entries[0].index & 0xFF for pdo in pdos]
        assert kinds == [0x00] + [0x10] * 12 + [0x30] * 12
        assert [pdo.predefined for pdo in pdos] == [True] * 4 + [False] * 21
    words = (MAPPINGS / "canopen-only.yaml").read_text()
    for place in ("2000h:01-40", "RPDO 2 to 13", "2430h:01-18", "TPDO 14 to 25"):
        assert place in words


def test_two_buses_contend_for_one_variable() -> None:
    found = plan("two-buses.yaml")
    lock = next(lock for lock in found.cell.locks if lock.name == "lamp")
    assert found.the(CanopenPlan) is not None
    assert [found.cell.writers[owner].name for owner in lock.owners] == ["plc", "line"]
    assert found.the(CanopenPlan).rpdo_writer == lock.owners[1]


def test_two_plcs_share_by_priority() -> None:
    """The group goes to the cell PLC first; the line PLC alone stops the line."""
    found = plan("two-plcs.yaml")
    names = [writer.name for writer in found.cell.writers]
    locks = {lock.name: ([names[owner] for owner in lock.owners], lock.takeover) for lock in found.cell.locks}
    assert locks["motion"] == (["cell_plc", "panel"], True)
    assert locks["line_stop"] == (["line_plc"], False)
    assert locks["call"] == (names, False)


def test_devices_are_where_only_documentation_is() -> None:
    """Whoever runs one by mistake reaches nobody (RFC 5737); the three families of lines are shown."""
    lines = set()
    for name in ("can-encoder.yaml", "io-island.yaml", "rtu-gripper.yaml"):
        found = plan(name)
        assert robot_of(found).host.startswith("192.0.2.")
        modbus = found.of(ModbusDevicePlan).values()
        lines |= {device.line.text for device in modbus}
        lines |= {device.address for device in found.of(CanopenDevicePlan).values()}
    assert lines == {"192.0.2.30:502", "/dev/ttyUSB0 115200 8N1", "can1 node 5"}

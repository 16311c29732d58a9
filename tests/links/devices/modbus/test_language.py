"""Places in Modbus devices."""

from __future__ import annotations

import pickle

import pytest

from gatewayd.links.devices.modbus.plan import LineAddress, SerialSettings
from gatewayd.modbus.areas import Area
from tests.links.devices.cells import HEAD, VARIABLES, device, loaded, planned


def test_lines() -> None:
    plan = planned()
    assert device(plan, "island").line == LineAddress("127.0.0.1", 1503)
    gripper = device(plan, "gripper").line
    assert gripper == LineAddress("/dev/ttyUSB0", framing="rtu", serial=SerialSettings(115200))
    assert (gripper.text, gripper.is_serial) == ("/dev/ttyUSB0 115200 8N1", True)
    converter = planned(head=HEAD.replace("poll: 20ms", "framing: rtu"))
    assert device(converter, "island").line.text == "127.0.0.1:1503 RTU"


def test_what_is_read_and_what_is_written_follows_from_the_robot() -> None:
    plan = planned()
    island = device(plan, "island")
    assert [placed.area for placed in island.inputs(plan.cell)] == [Area.DISCRETE, Area.INPUT, Area.HOLDING]
    (clamp,) = island.outputs(plan.cell)
    assert (clamp.area, clamp.poll, clamp.keeps_rest) == (Area.COIL, None, None)


def test_bits_of_a_register() -> None:
    plan = planned()
    (force,) = device(plan, "gripper").placements
    assert (force.address, force.bit, force.width, force.keeps_rest) == (1002, 0, 8, True)
    assert force.place == "1002.0..7"
    assert list(force.bits) == list(range(8))


def test_a_family_of_bits_has_a_register_each() -> None:
    lines = (
        "  force: {robot: output_int_register_0..2, device: {at: gripper, holding: 5, bits: 4..7, rest: 0}}\n"
    )
    placed = device(planned(lines + VARIABLES.replace("  force:", "  other:")), "gripper").placements
    assert [(each.address, each.bit, each.keeps_rest) for each in placed[:3]] == [
        (5, 4, False), (6, 4, False), (7, 4, False),
    ]  # fmt: skip


@pytest.mark.parametrize(
    "place, rule",
    [
        ("{at: island, coil: 0, bits: 0..7}", "bad-address"),
        ("{at: island, coil: 0.3}", "bad-address"),
        ("{at: island, holding: 0, coil: 1}", "missing-key"),
        ("{at: island}", "missing-key"),
        ("{at: island, holding: 0, type: int8}", "byte-type"),
        ("{at: island, holding: 0, scale: 0}", "scale-of-zero"),
        ("{at: island, coil: 0}", "number-in-bit"),
        ("{at: island, holding: 65535, type: int32}", "beyond-last-address"),
    ],
)
def test_the_rules_for_places_are_those_of_the_server(place: str, rule: str) -> None:
    found = loaded(f"  speed: {{robot: output_int_register_0, device: {place}}}\n").diagnostics
    assert rule in [each.rule.slug for each in found]


def test_a_plan_travels_between_processes() -> None:
    plan = planned()
    assert pickle.loads(pickle.dumps(plan)) == plan  # noqa: S301 - our own

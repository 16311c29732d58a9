"""One robot, several programs: the ROS 2 driver's recipes, ur_rtde, a fieldbus adapter, the gateway's full image."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path

import pytest

from tests.e2e.plant import Plant
from tests.e2e.plc import NO_PATH, PLC, Plc
from tests.e2e.processes import HOST, Daemon, Process, Simulator, wait_for

needs_ur_rtde = pytest.mark.skipif(
    importlib.util.find_spec("rtde_receive") is None, reason="ur_rtde is not installed here"
)
IMAGE = Path(__file__).parents[2] / "mappings" / "full-image.yaml"
PORT = 30004
"""ur_rtde knows no other."""
COUNT = 224
"""Variables of the full image."""
UPPER = """
import sys, time
from rtde_receive import RTDEReceiveInterface
receive = RTDEReceiveInterface(sys.argv[1], 125.0, [], False, True, 0)
print("receiving", receive.getRobotMode(), flush=True)
"""
WRITES = """
from rtde_io import RTDEIOInterface
try:
    io = RTDEIOInterface(sys.argv[1], False, sys.argv[2] == "upper")
except RuntimeError as error:
    print("refused", str(error).replace(chr(10), " "), flush=True)
    sys.exit()
first = 42 if sys.argv[2] == "upper" else 18
print("claimed", flush=True)
for line in sys.stdin:
    done = io.setInputIntRegister(first, int(line)), io.setInputDoubleRegister(first, int(line) / 4)
    print("written", *done, flush=True)
"""


def robot(plant: Plant, *options: str) -> Simulator:
    return plant.simulator("--program", "demo", *options, port=PORT)


def image(plant: Plant) -> Daemon:
    """The shipped full image, unchanged but for the addresses."""
    text = IMAGE.read_text()
    for place, value in (
        (r"host: 192\.0\.2\.10", f"host: {HOST}\n  stale_after: 600ms"),
        (r"listen: 127\.0\.0\.1:\d+", f"listen: {HOST}:{plant.modbus}"),
        (r"modbus: 127\.0\.0\.1,", f"modbus: {PLC},"),
    ):
        text, found = re.subn(place, value, text)
        assert found == 1
    path = plant.directory / IMAGE.name
    path.write_text(text)
    return plant.daemon(path)


def ros_driver(plant: Plant) -> Process:
    return plant.start("ros_driver", HOST, PORT)


def ur_rtde(plant: Plant, script: str, registers: str = "upper") -> Process:
    return plant.program([sys.executable, "-c", script, HOST, registers], "ur_rtde")


def say(process: Process, line: str) -> str:
    assert process.popen.stdin is not None
    process.popen.stdin.write(line + "\n")
    return process.answer()


def qualities(plc: Plc) -> dict[int, int]:
    """Variables that are not good."""
    found = {number: plc.quality(number) for number in range(1, COUNT + 1)}
    return {number: quality for number, quality in found.items() if quality}


def assert_image_works(plc: Plc, number: int) -> None:
    """Every variable good; what the PLC writes comes back through the robot program."""
    wait_for(lambda: not qualities(plc), "every variable to be good")
    assert plc.write(0, [number & 0xFFFF]) == 0
    assert plc.write_integers(100 + 2 * 23, number) == 0
    assert plc.write_doubles(200 + 4 * 23, number / 8) == 0
    wait_for(lambda: plc.integers(1100 + 2 * 23) == [number], "the integer to come back")
    wait_for(lambda: plc.doubles(1200 + 4 * 23) == [number / 8], "the real to come back")
    wait_for(lambda: plc.read(1000) == [number & 0xFFFF], "the bits to come back")


@needs_ur_rtde
def test_driver_reader_and_full_image_work_together(plant: Plant) -> None:
    simulator = robot(plant)
    driver = ros_driver(plant)
    assert driver.answer() == "ready"
    daemon = image(plant)
    plc = plant.ready_plc()
    reader = ur_rtde(plant, UPPER + "for line in sys.stdin: print(receive.getTimestamp(), flush=True)\n")
    assert reader.answer() == "receiving 7"
    for number in (1, 77, 30000):
        assert_image_works(plc, number)
        assert say(driver, f"24 {number}") == "written 0"
        assert simulator.number("input_double_register_24") == number
        assert float(say(reader, "")) > 0
    assert not daemon.lines("register unavailable")
    assert simulator.do("clients") == "3"


@needs_ur_rtde
@pytest.mark.parametrize("gateway_first", [True, False])
def test_a_writer_in_the_upper_range_and_the_full_image_do_not_meet(
    plant: Plant, *, gateway_first: bool
) -> None:
    simulator = robot(plant)
    if gateway_first:
        image(plant)
        plant.ready_plc()
    writer = ur_rtde(plant, UPPER + WRITES)
    assert (writer.answer(), writer.answer()) == ("receiving 7", "claimed")
    if not gateway_first:
        image(plant)
    plc = plant.ready_plc()
    assert_image_works(plc, 12)
    assert say(writer, "40") == "written True True"
    wait_for(lambda: simulator.integer("input_int_register_42") == 40, "the register of ur_rtde")
    assert simulator.number("input_double_register_42") == 10
    assert_image_works(plc, 13)


@needs_ur_rtde
def test_the_lower_range_is_the_gateways_when_it_was_first(plant: Plant) -> None:
    robot(plant)
    image(plant)
    plc = plant.ready_plc()
    wait_for(lambda: not qualities(plc), "every variable to be good")
    writer = ur_rtde(plant, UPPER + WRITES, "lower")
    assert writer.answer() == "receiving 7"
    assert "already in use" in writer.answer()
    assert_image_works(plc, 14)


@needs_ur_rtde
def test_the_lower_range_costs_its_registers_and_nothing_else_when_ur_rtde_was_first(plant: Plant) -> None:
    """Integers and doubles 18 to 22, and the command register 23: variables 83 to 88 and 107 to 112."""
    robot(plant)
    writer = ur_rtde(plant, UPPER + WRITES, "lower")
    assert (writer.answer(), writer.answer()) == ("receiving 7", "claimed")
    daemon = image(plant)
    plc = plant.ready_plc()
    daemon.wait_for_line("register unavailable", "field=input_int_register_18")
    wait_for(lambda: set(qualities(plc).values()) == {2}, "the others to be good")
    lost = set(qualities(plc))
    assert {64 + 1 + number for number in range(18, 23)} <= lost
    assert {64 + 24 + 1 + number for number in range(18, 23)} <= lost
    assert lost <= {64 + 1 + number for number in range(18, 24)} | {
        88 + 1 + number for number in range(18, 24)
    }
    assert plc.write_integers(100 + 2 * 18, 1) == NO_PATH
    assert plc.write_integers(100, 5) == 0
    writer.kill()
    assert_image_works(plc, 15)


@needs_ur_rtde
def test_driver_and_ur_rtde_want_the_same_io(plant: Plant) -> None:
    """Whatever its range, ur_rtde's writer claims speed slider and digital outputs, as the driver does."""
    robot(plant)
    driver = ros_driver(plant)
    assert driver.answer() == "ready"
    writer = ur_rtde(plant, UPPER + WRITES)
    assert writer.answer() == "receiving 7"
    assert "already in use" in writer.answer()


@pytest.mark.parametrize("adapter", ["profinet", "ethernet-ip"])
def test_an_enabled_adapter_leaves_the_gateway_to_read(plant: Plant, adapter: str) -> None:
    """Every reserved input is held by the controller itself; outputs are as ever, and writes are refused with 0A."""
    robot(plant, "--adapter", adapter)
    daemon = image(plant)
    plc = plant.plc()
    wait_for(lambda: set(qualities(plc)) == set(range(1, 113)), "the outputs to be good, and no input")
    assert set(qualities(plc).values()) == {2}
    assert plc.write(0, [1]) == NO_PATH
    assert plc.write_integers(100, 5) == NO_PATH
    assert "PROFINET or EtherNet/IP" in daemon.wait_for_line("register unavailable")
    driver = ros_driver(plant)
    assert "speed_slider_mask" in driver.answer()

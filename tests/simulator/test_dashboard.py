"""What the simulated dashboard server answers, and what it does to the robot."""

from __future__ import annotations

import pytest

from gatewayd.rtde.fields import Series, SoftwareVersion
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.dashboard import LOCAL, TOO_SOON, PolyScope


class Robot:
    """A controller with its dashboard, whose time passes on request."""

    def __init__(self, series: Series = Series.E, version: SoftwareVersion | None = None) -> None:
        self.controller = Controller(series, version)
        self.polyscope = PolyScope(self.controller)

    def say(self, line: str) -> str:
        return self.polyscope.answer(line, allowed=True)

    def wait(self, seconds: float) -> None:
        self.controller.advance(round(seconds * self.controller.rate))


def test_an_arm_is_switched_on_step_by_step() -> None:
    robot = Robot()
    assert robot.say("power off") == "Powering off"
    robot.wait(2)
    assert robot.say("robotmode") == "Robotmode: POWER_OFF"
    assert robot.say("play") == "Failed to execute: play"
    assert robot.say("power on") == "Powering on"
    robot.wait(3)
    assert robot.say("robotmode") == "Robotmode: IDLE"
    assert robot.say("Brake Release") == "Brake releasing"
    robot.wait(2)
    assert robot.say("robotmode") == "Robotmode: RUNNING"
    assert robot.say("play") == "Starting program"


def test_releasing_the_brakes_switches_the_arm_on() -> None:
    robot = Robot()
    robot.say("power off")
    robot.wait(2)
    assert robot.say("brake release") == "Brake releasing"
    robot.wait(4)
    assert robot.say("robotmode") == "Robotmode: RUNNING"


def test_programs_are_loaded_started_paused_and_stopped() -> None:
    robot = Robot()
    assert robot.say("programState") == "PLAYING pick.urp"
    assert robot.say("load place.urp") == "Error while loading program: place.urp"
    assert robot.say("pause") == "Pausing program"
    robot.wait(1)
    assert robot.say("programState") == "PAUSED pick.urp"
    assert robot.say("stop") == "Stopped"
    robot.wait(1)
    assert robot.say("stop") == "Failed to execute: stop"
    assert robot.say("load nothing.urp") == "File not found: nothing.urp"
    assert robot.say("load /programs/place.urp") == "Loading program: /programs/place.urp"
    assert robot.say("get loaded program") == "Loaded program: /programs/place.urp"
    assert robot.say("running") == "Program running: false"


def test_without_a_program_nothing_is_started() -> None:
    robot = Robot()
    robot.say("stop")
    robot.wait(1)
    robot.polyscope.loaded = None
    assert robot.say("get loaded program") == "No program loaded"
    assert robot.say("programState") == "STOPPED <unnamed>"
    assert robot.say("play") == "Failed to execute: play"


def test_a_protective_stop_is_not_unlocked_in_its_first_5_s() -> None:
    robot = Robot()
    robot.controller.modes.set_safety("protective-stop")
    assert robot.say("safetystatus") == "Safetystatus: PROTECTIVE_STOP"
    robot.wait(4)
    assert robot.say("unlock protective stop") == TOO_SOON
    robot.wait(2)
    assert robot.say("unlock protective stop") == "Protective stop releasing"
    assert robot.say("safetystatus") == "Safetystatus: NORMAL"


@pytest.mark.parametrize("line", ["play", "load pick.urp", "power on", "unlock protective stop"])
def test_local_control_refuses_what_acts_and_tells_the_rest(line: str) -> None:
    robot = Robot()
    robot.polyscope.remote = False
    assert robot.say(line) == LOCAL
    assert robot.say("is in remote control") == "false"
    assert robot.say("robotmode") == "Robotmode: RUNNING"
    robot.polyscope.remote = True
    assert robot.polyscope.answer(line, allowed=False) == LOCAL


@pytest.mark.parametrize(
    "series, version, line, known",
    [
        (Series.CB3, SoftwareVersion(3, 15), "is in remote control", False),
        (Series.CB3, SoftwareVersion(3, 10), "safetystatus", False),
        (Series.CB3, SoftwareVersion(3, 10), "safetymode", True),
        (Series.CB3, SoftwareVersion(3, 11), "safetystatus", True),
        (Series.E, SoftwareVersion(5, 5), "is in remote control", False),
        (Series.E, SoftwareVersion(5, 12), "fly", False),
        (Series.E, SoftwareVersion(5, 12), "", False),
        (Series.E, SoftwareVersion(5, 12), "popup hello", True),
        (Series.E, SoftwareVersion(5, 12), "PolyscopeVersion", True),
    ],
)
def test_software_knows_what_it_knows(
    series: Series,
    version: SoftwareVersion,
    line: str,
    known: bool,
) -> None:
    assert Robot(series, version).say(line).startswith("could not understand") is not known


def test_a_cb3_controller_knows_no_local_control() -> None:
    robot = Robot(Series.CB3)
    robot.polyscope.remote = False
    assert robot.say("pause") == "Pausing program"


def test_polyscope_x_has_none() -> None:
    with pytest.raises(ValueError, match="PolyScope X has no dashboard server"):
        Robot(Series.X)

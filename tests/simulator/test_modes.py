"""Power, safety and program: the sequences that clients see."""

from __future__ import annotations

from collections.abc import Callable
from itertools import groupby

import pytest

from gatewayd.rtde.enums import ProgramState, RobotMode, SafetyStatus
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.modes import POWER, PROGRAM, SAFETY, ModeError

Act = Callable[[Controller], None]


@pytest.fixture
def controller() -> Controller:
    return Controller()


def seen(controller: Controller, field: str, seconds: float) -> list[int]:
    """The values that a client sees of a field, each once, while time passes."""
    values = [controller.get(field)[0]]
    for _ in range(round(seconds * controller.rate)):
        controller.advance()
        values.append(controller.get(field)[0])
    return [int(value) for value, _ in groupby(values)]


def bits(controller: Controller, field: str) -> set[int]:
    value = int(controller.get(field)[0])
    return {number for number in range(32) if value >> number & 1}


def switched_off(controller: Controller) -> Controller:
    controller.modes.switch_power("off")
    controller.advance(500)
    return controller


def test_switching_off_ends_the_program_and_the_power(controller: Controller) -> None:
    controller.modes.switch_power("off")
    assert seen(controller, "robot_mode", 2) == [RobotMode.RUNNING, RobotMode.IDLE, RobotMode.POWER_OFF]
    assert controller.get("runtime_state") == (ProgramState.STOPPED,)
    assert bits(controller, "robot_status_bits") == set()
    assert controller.get("joint_mode") == (239,) * 6
    assert not any(controller.get("actual_current") + controller.get("actual_robot_voltage"))
    assert not any(controller.get("actual_qd"))


def test_switching_on_goes_through_the_modes_of_a_real_robot(controller: Controller) -> None:
    switched_off(controller)
    controller.modes.switch_power("on")
    modes = [RobotMode.POWER_ON, RobotMode.BOOTING, RobotMode.IDLE]
    assert seen(controller, "robot_mode", 5) == modes
    assert bits(controller, "robot_status_bits") == {0}
    assert not any(controller.get("actual_current"))
    controller.modes.switch_power("release")
    assert seen(controller, "joint_mode", 2) == [246, 253]
    assert controller.get("robot_mode") == (RobotMode.RUNNING,)
    assert all(controller.get("actual_current"))
    controller.modes.run_program("play")
    assert seen(controller, "runtime_state", 1) == [ProgramState.RUNNING]
    assert bits(controller, "robot_status_bits") == {0, 1}


def test_a_paused_program_brakes_and_resumes(controller: Controller) -> None:
    controller.modes.run_program("pause")
    controller.advance()
    braking = controller.store.moment.rate
    assert 0.9 < braking < 1
    assert seen(controller, "runtime_state", 1) == [ProgramState.PAUSING, ProgramState.PAUSED]
    assert not any(controller.get("target_qd"))
    controller.modes.run_program("play")
    assert seen(controller, "runtime_state", 1) == [ProgramState.RESUMING, ProgramState.RUNNING]
    assert controller.store.moment.rate == 1


def test_a_protective_stop_pauses_and_is_unlocked_after_five_seconds(controller: Controller) -> None:
    controller.modes.set_safety("protective-stop")
    assert controller.get("safety_mode") == controller.get("safety_status") == (3,)
    assert bits(controller, "safety_status_bits") == {2, 10}
    assert seen(controller, "runtime_state", 4.9) == [ProgramState.PAUSING, ProgramState.PAUSED]
    assert controller.get("robot_mode") == (RobotMode.RUNNING,)
    with pytest.raises(ModeError, match=r"cannot be unlocked in its first 5 s; 0\.1 s are left"):
        controller.modes.set_safety("normal")
    with pytest.raises(ModeError, match="the safety status is PROTECTIVE_STOP"):
        controller.modes.run_program("play")
    controller.advance(50)
    controller.modes.set_safety("normal")
    assert bits(controller, "safety_status_bits") == {0}
    assert seen(controller, "runtime_state", 1) == [ProgramState.PAUSED]
    controller.modes.run_program("play")
    assert seen(controller, "runtime_state", 1) == [ProgramState.RESUMING, ProgramState.RUNNING]


def test_a_program_goes_on_by_itself_after_a_safeguard_stop(controller: Controller) -> None:
    controller.modes.set_safety("safeguard-stop")
    assert bits(controller, "safety_status_bits") == {4, 10}
    controller.advance(500)
    controller.modes.set_safety("reduced")
    assert seen(controller, "runtime_state", 1) == [ProgramState.RESUMING, ProgramState.RUNNING]
    assert bits(controller, "safety_status_bits") == {1}


def test_a_program_that_was_paused_before_a_safeguard_stop_stays_so(controller: Controller) -> None:
    controller.modes.run_program("pause")
    controller.advance(500)
    controller.modes.set_safety("safeguard-stop")
    controller.advance(500)
    controller.modes.set_safety("normal")
    assert seen(controller, "runtime_state", 1) == [ProgramState.PAUSED]


@pytest.mark.parametrize(
    "name,mode,shown",
    [
        ("robot-emergency-stop", RobotMode.IDLE, {6, 7, 10}),
        ("system-emergency-stop", RobotMode.IDLE, {5, 7, 10}),
        ("violation", RobotMode.POWER_OFF, {8, 10}),
        ("fault", RobotMode.POWER_OFF, {9, 10}),
    ],
)
def test_an_emergency_ends_program_and_motion(
    controller: Controller, name: str, mode: RobotMode, shown: set[int]
) -> None:
    controller.modes.set_safety(name)
    assert bits(controller, "safety_status_bits") == shown
    assert seen(controller, "runtime_state", 2) == [ProgramState.STOPPING, ProgramState.STOPPED]
    assert controller.get("robot_mode") == (mode,)
    with pytest.raises(ModeError, match="`safety normal` ends it"):
        controller.modes.switch_power("on" if mode == RobotMode.POWER_OFF else "release")
    controller.modes.set_safety("normal")
    controller.modes.switch_power("on" if mode == RobotMode.POWER_OFF else "release")


@pytest.mark.parametrize(
    "act,message",
    [
        (lambda c: c.modes.switch_power("on"), "the robot is RUNNING; it has to be POWER_OFF"),
        (lambda c: c.modes.switch_power("release"), "the robot is RUNNING; it has to be IDLE"),
        (lambda c: c.modes.run_program("play"), "the program is RUNNING; it has to be STOPPED or PAUSED"),
        (
            lambda c: switched_off(c).modes.run_program("play"),
            "the robot is POWER_OFF; it has to be RUNNING",
        ),
    ],
)
def test_what_the_mode_does_not_allow_is_refused(controller: Controller, act: Act, message: str) -> None:
    with pytest.raises(ModeError, match=message):
        act(controller)


def test_a_mode_that_nobody_knows_is_named_by_its_number(controller: Controller) -> None:
    controller.set("robot_mode", (99,))
    with pytest.raises(ModeError, match="the robot is in mode 99; it has to be POWER_OFF"):
        controller.modes.switch_power("on")


def test_a_field_that_is_written_changes_nothing_else(controller: Controller) -> None:
    controller.set("safety_mode", (3,))
    assert seen(controller, "runtime_state", 1) == [ProgramState.RUNNING]
    assert controller.get("safety_status") == (1,)


def test_finish_brings_a_sequence_to_its_end(controller: Controller) -> None:
    controller.modes.switch_power("off")
    assert controller.modes.pending
    controller.modes.finish()
    controller.advance()
    assert controller.get("robot_mode") == (RobotMode.POWER_OFF,)
    assert controller.get("robot_status_bits") == (0,)


def test_frozen_time_stops_a_sequence(controller: Controller) -> None:
    controller.modes.run_program("pause")
    controller.faults.freeze = True
    assert seen(controller, "runtime_state", 2) == [ProgramState.PAUSING]


def test_the_tables_use_known_numbers() -> None:
    assert {condition.status for condition in SAFETY.values()} == set(SafetyStatus) & set(range(1, 10))
    for name, sequence in {**POWER, **PROGRAM}.items():
        assert sequence.start, name
        assert sequence.steps, name

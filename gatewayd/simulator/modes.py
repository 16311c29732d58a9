"""Power, safety and program of the robot, in the order in which a real one goes through its modes.

Three tables say what happens: `POWER` and `PROGRAM` (the steps of a command, each with the seconds since the one
before) and `SAFETY` (what a condition shows, and what it does to program and power). Sequences are as users of
Universal Robots' drivers report them; how long each step takes differs from robot to robot. A protective stop pauses
the program and leaves the arm powered; it cannot be unlocked in its first 5 s. An emergency stop ends the program and
applies the brakes.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from gatewayd.rtde.enums import JointMode, ProgramState, RobotMode, SafetyStatus
from gatewayd.simulator.arm import BRAKED, DRIVEN, OFF
from gatewayd.simulator.store import FieldStore, Scalar

UNLOCK_AFTER = 5.0
"""Seconds that a protective stop lasts at least."""
BRAKING = 0.25
"""Seconds from full speed to a standstill."""

_POWER_ON_BIT, _PROGRAM_RUNNING_BIT = 0b01, 0b10  # robot_status_bits


class ModeError(ValueError):
    """A command that the robot refuses in its present mode."""


class ModeStep(NamedTuple):
    """Fields that change, `after` seconds of the step before."""

    after: float
    values: Mapping[str, int]


class ModeSequence(NamedTuple):
    """What a command does, and where from."""

    start: frozenset[int]
    """Modes or states in which the robot takes the command."""
    steps: tuple[ModeStep, ...]


def _power(after: float, robot: RobotMode, joint: JointMode) -> ModeStep:
    return ModeStep(after, {"robot_mode": robot, "joint_mode": joint})


def _program(after: float, state: ProgramState) -> ModeStep:
    return ModeStep(after, {"runtime_state": state})


_ON = frozenset(
    {RobotMode.POWER_ON, RobotMode.BOOTING, RobotMode.IDLE, RobotMode.BACKDRIVE, RobotMode.RUNNING}
)
_ACTIVE = frozenset({ProgramState.RUNNING, ProgramState.RESUMING})

_SWITCHING_ON = (
    _power(0.0, RobotMode.POWER_ON, JointMode.BOOTING),
    _power(0.5, RobotMode.BOOTING, JointMode.BOOTING),
    _power(1.5, RobotMode.IDLE, JointMode.IDLE),
)
_RELEASING = (
    _power(0.0, RobotMode.IDLE, JointMode.MOTOR_INITIALISATION),
    _power(1.0, RobotMode.RUNNING, JointMode.RUNNING),
)

POWER: Mapping[str, ModeSequence] = {
    "on": ModeSequence(frozenset({RobotMode.POWER_OFF}), _SWITCHING_ON),
    "release": ModeSequence(frozenset({RobotMode.IDLE}), _RELEASING),
    "start": ModeSequence(frozenset({RobotMode.POWER_OFF}), (*_SWITCHING_ON, *_RELEASING)),
    "off": ModeSequence(
        _ON,
        (
            _power(BRAKING, RobotMode.IDLE, JointMode.SHUTTING_DOWN),
            _power(0.5, RobotMode.POWER_OFF, JointMode.POWER_OFF),
        ),
    ),
    "brake": ModeSequence(_ON, (_power(BRAKING, RobotMode.IDLE, JointMode.IDLE),)),
}
"""Commands of the arm's power; `brake` is what an emergency stop does, `start` what releasing the brakes does by the
dashboard server while the arm is off."""

POWER_COMMANDS = ("on", "off", "release")
"""Those of them that a person gives."""

PROGRAM: Mapping[str, ModeSequence] = {
    "play": ModeSequence(
        frozenset({ProgramState.STOPPED, ProgramState.PAUSED}),
        (_program(0.0, ProgramState.RESUMING), _program(BRAKING, ProgramState.RUNNING)),
    ),
    "pause": ModeSequence(
        _ACTIVE, (_program(0.0, ProgramState.PAUSING), _program(BRAKING, ProgramState.PAUSED))
    ),
    "stop": ModeSequence(
        frozenset(ProgramState) - {ProgramState.STOPPED, ProgramState.STOPPING},
        (_program(0.0, ProgramState.STOPPING), _program(BRAKING, ProgramState.STOPPED)),
    ),
}
"""Commands of the robot program. From STOPPED it starts at once, without RESUMING."""


class SafetyEffect(Enum):
    """What a safety condition does to the program."""

    NONE = "none"
    PAUSE = "pause"
    STOP = "stop"


@dataclass(frozen=True, slots=True)
class SafetyCondition:
    """What the robot shows in a condition of its safety system, and what follows."""

    status: SafetyStatus
    bits: int
    """`safety_status_bits`."""
    program: SafetyEffect = SafetyEffect.NONE
    power: str | None = None
    """The command of `POWER` that follows."""


def _bits(*numbers: int) -> int:
    return sum(1 << number for number in numbers)


SAFETY: Mapping[str, SafetyCondition] = {
    "normal": SafetyCondition(SafetyStatus.NORMAL, _bits(0)),
    "reduced": SafetyCondition(SafetyStatus.REDUCED, _bits(1)),
    "protective-stop": SafetyCondition(SafetyStatus.PROTECTIVE_STOP, _bits(2, 10), SafetyEffect.PAUSE),
    "safeguard-stop": SafetyCondition(SafetyStatus.SAFEGUARD_STOP, _bits(4, 10), SafetyEffect.PAUSE),
    "recovery": SafetyCondition(SafetyStatus.RECOVERY, _bits(3), SafetyEffect.STOP),
    "system-emergency-stop": SafetyCondition(
        SafetyStatus.SYSTEM_EMERGENCY_STOP, _bits(5, 7, 10), SafetyEffect.STOP, "brake"
    ),
    "robot-emergency-stop": SafetyCondition(
        SafetyStatus.ROBOT_EMERGENCY_STOP, _bits(6, 7, 10), SafetyEffect.STOP, "brake"
    ),
    "violation": SafetyCondition(SafetyStatus.VIOLATION, _bits(8, 10), SafetyEffect.STOP, "off"),
    "fault": SafetyCondition(SafetyStatus.FAULT, _bits(9, 10), SafetyEffect.STOP, "off"),
}
"""Conditions by the names of the command `safety`."""

_MOVING = frozenset({SafetyStatus.NORMAL, SafetyStatus.REDUCED})


class RobotModes:
    """The modes of one controller, kept in its store. A direct write to those fields changes nothing else."""

    def __init__(self, store: FieldStore, rate: float) -> None:
        self._store = store
        self._rate = rate
        self._power: deque[tuple[int, Mapping[str, int]]] = deque()
        self._program: deque[tuple[int, Mapping[str, int]]] = deque()
        self._since_safety = 0
        self._resumes = False
        self.gliding = False
        """Whether `share` is on its way from 0 to 1 or back."""
        self._seen_mode = self._get("robot_mode")
        self.share = float(self._get("runtime_state") == ProgramState.RUNNING)
        """Share of the allowed speed: between 0 and 1 while the program pauses, stops or resumes."""

    @property
    def power(self) -> int:
        """`DRIVEN`, `BRAKED` or `OFF`, by `robot_mode`."""
        mode = self._get("robot_mode")
        if mode in (RobotMode.RUNNING, RobotMode.BACKDRIVE):
            return DRIVEN
        return BRAKED if mode in _ON else OFF

    @property
    def pending(self) -> bool:
        """Whether a sequence is under way."""
        return bool(self._power or self._program)

    def switch_power(self, command: str) -> None:
        """`on`, `off`, `release` (the brakes) or `start` (both). ModeError if the robot is not in the mode for it."""
        mode = self._get("robot_mode")
        if mode not in POWER[command].start:
            self._refuse(f"the robot is {_name(RobotMode, mode)}", RobotMode, POWER[command].start)
        if command != "off" and self._get("safety_status") not in _MOVING:
            self._refuse_for_safety()
        if command == "off" and self._get("runtime_state") in PROGRAM["stop"].start:
            self._run_program("stop")
        self._begin(self._power, POWER[command].steps)

    def run_program(self, command: str) -> None:
        """`play`, `pause` or `stop`. ModeError if it cannot be done now."""
        state = self._get("runtime_state")
        if state not in PROGRAM[command].start:
            self._refuse(f"the program is {_name(ProgramState, state)}", ProgramState, PROGRAM[command].start)
        if command == "play" and self._get("safety_status") not in _MOVING:
            self._refuse_for_safety()
        if command == "play" and (mode := self._get("robot_mode")) != RobotMode.RUNNING:
            self._refuse(f"the robot is {_name(RobotMode, mode)}", RobotMode, {RobotMode.RUNNING})
        self._resumes = False
        self._run_program(command)

    def set_safety(self, name: str) -> None:
        """Enter a condition of `SAFETY`. ModeError for a protective stop that is to end in its first 5 s."""
        condition = SAFETY[name]
        before = self._get("safety_status")
        left = UNLOCK_AFTER - self._since_safety / self._rate
        if before == SafetyStatus.PROTECTIVE_STOP and condition.status in _MOVING and left > 0:
            message = (
                f"a protective stop cannot be unlocked in its first {UNLOCK_AFTER:g} s; {left:.3g} s are left"
            )
            raise ModeError(message)
        status = int(condition.status)
        self._show({"safety_mode": status, "safety_status": status, "safety_status_bits": condition.bits})
        self._since_safety = 0
        self._affect(condition.program, before, condition.status)
        if condition.power is not None and self._get("robot_mode") in POWER[condition.power].start:
            self._begin(self._power, POWER[condition.power].steps)

    def advance(self, cycles: int) -> None:
        """Let `cycles` control cycles pass."""
        self._since_safety += cycles
        for track in (self._power, self._program):
            self._count(track, cycles)
        self._glide(cycles)
        self.follow()

    def finish(self) -> None:
        """Bring every sequence to its end at once."""
        for track in (self._power, self._program):
            while track:
                self._show(track.popleft()[1])
        self.gliding = False
        self._glide(0)
        self.follow()

    def follow(self) -> None:
        """Keep the bits of `robot_status_bits` that say the same as other fields in step with them."""
        bits = now = self._get("robot_status_bits")
        running = self._get("runtime_state") == ProgramState.RUNNING
        bits = bits | _PROGRAM_RUNNING_BIT if running else bits & ~_PROGRAM_RUNNING_BIT
        mode = self._get("robot_mode")
        if mode != self._seen_mode:
            self._seen_mode = mode
            bits = bits | _POWER_ON_BIT if mode in _ON else bits & ~_POWER_ON_BIT
        if bits != now:
            self._show({"robot_status_bits": bits})

    def _affect(self, effect: SafetyEffect, before: int, after: SafetyStatus) -> None:
        state = self._get("runtime_state")
        if effect is not SafetyEffect.NONE and state in PROGRAM[effect.value].start:
            self._resumes = after == SafetyStatus.SAFEGUARD_STOP
            self._run_program(effect.value)
        elif before == SafetyStatus.SAFEGUARD_STOP and after in _MOVING and self._resumes:
            self._run_program("play")

    def _run_program(self, command: str) -> None:
        steps = PROGRAM[command].steps
        if command == "play" and self._get("runtime_state") == ProgramState.STOPPED:
            steps = (steps[-1]._replace(after=0.0),)
        self.gliding = True
        self._begin(self._program, steps)

    def _begin(self, track: deque[tuple[int, Mapping[str, int]]], steps: Iterable[ModeStep]) -> None:
        track.clear()
        track.extend((round(step.after * self._rate), step.values) for step in steps)
        self._count(track, 0)

    def _count(self, track: deque[tuple[int, Mapping[str, int]]], cycles: int) -> None:
        while track:
            left, values = track[0]
            if left > cycles:
                track[0] = (left - cycles, values)
                return
            cycles -= left
            track.popleft()
            self._show(values)

    def _glide(self, cycles: int) -> None:
        """Brake or speed up while a sequence says so; else full speed or none, as `runtime_state` says."""
        goal = float(self._get("runtime_state") in (_ACTIVE if self.gliding else {ProgramState.RUNNING}))
        step = cycles / (BRAKING * self._rate) if self.gliding else 1.0
        self.share = min(goal, self.share + step) if goal else max(goal, self.share - step)
        self.gliding = self.gliding and self.share != goal

    def _show(self, values: Mapping[str, int]) -> None:
        for name, value in values.items():
            elements: tuple[Scalar, ...] = (int(value),) * self._store.type(name).count
            self._store.write(name, elements)

    def _get(self, name: str) -> int:
        return int(self._store.cells[self._store.place(name)][0])

    def _refuse_for_safety(self) -> None:
        status = _name(SafetyStatus, self._get("safety_status"))
        message = f"the safety status is {status}; `safety normal` ends it"
        raise ModeError(message)

    def _refuse(self, now: str, kind: type[RobotMode | ProgramState], wanted: Iterable[int]) -> None:
        message = f"{now}; it has to be {' or '.join(kind(mode).name for mode in sorted(wanted))}"
        raise ModeError(message)


def _name(kind: type[RobotMode | ProgramState | SafetyStatus], value: int) -> str:
    return kind(value).name if value in set(kind) else f"in mode {value}"

"""The dashboard server of a simulated controller, line by line: what PolyScope answers, and what it does to the robot.

    load NAME, play, pause, stop, power on, power off, brake release, unlock protective stop      act
    robotmode, safetystatus, safetymode, programState, get loaded program, running                tell
    is in remote control, PolyscopeVersion, get robot model, isProgramSaved                       tell
    popup TEXT, close popup, close safety popup, addToLog TEXT, quit                              are answered

Answers as Universal Robots documents them for CB3 and e-Series, refusals as users report them. An e-Series controller
does nothing for connections while it is in local control; one that was opened then has to be opened anew afterwards.
No sockets: `gatewayd.simulator.dashboard_server` has them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from gatewayd.rtde.enums import ProgramState, RobotMode, SafetyStatus
from gatewayd.rtde.fields import Series, SoftwareVersion
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.modes import ModeError

GREETING = "Connected: Universal Robots Dashboard Server"
LOCAL = (
    "Command is not allowed due to safety reasons, please switch robot to Remote Control mode and reconnect to "
    "port 29999"
)
TOO_SOON = (
    "Cannot unlock protective stop until 5s after occurrence. "
    "Always inspect cause of protective stop before unlocking"
)
DIRECTORY = "/programs/"
DEFAULT_PROGRAMS = ("pick.urp", "place.urp")
"""Programs that there are by default; the first one is loaded."""

_SINCE: Mapping[str, Mapping[Series, SoftwareVersion]] = {
    "safetystatus": {Series.CB3: SoftwareVersion(3, 11), Series.E: SoftwareVersion(5, 4)},
    "is in remote control": {Series.E: SoftwareVersion(5, 6)},
    "get robot model": {Series.CB3: SoftwareVersion(3, 12), Series.E: SoftwareVersion(5, 6)},
}
"""What not all software knows, and from which on."""
_STATES = {
    ProgramState.RUNNING: "PLAYING",
    ProgramState.RESUMING: "PLAYING",
    ProgramState.RETRACTING: "PLAYING",
    ProgramState.STOPPING: "PLAYING",
    ProgramState.PAUSING: "PLAYING",
    ProgramState.PAUSED: "PAUSED",
}
"""As long as the arm brakes, the program has not come to its end."""


class PolyScope:
    """The robot's user interface, as far as the dashboard server shows it; ValueError for a PolyScope X controller."""

    def __init__(self, controller: Controller, programs: tuple[str, ...] = DEFAULT_PROGRAMS) -> None:
        if controller.series is Series.X:
            raise ValueError("PolyScope X has no dashboard server")
        self._controller = controller
        self.programs = programs
        """Files that can be loaded."""
        self.loaded: str | None = programs[0] if programs else None
        """The loaded one."""
        self.remote = True
        """Whether it is in remote control, where the series has that: e-Series."""
        self._acts: Mapping[str, Callable[[], str]] = {
            "play": lambda: self._run("play", "Starting program"),
            "pause": lambda: self._run("pause", "Pausing program"),
            "stop": lambda: self._run("stop", "Stopped"),
            "power on": lambda: self._power("on", "Powering on"),
            "power off": lambda: self._power("off", "Powering off"),
            "brake release": self._release,
            "unlock protective stop": self._unlock,
        }
        self._tells: Mapping[str, Callable[[], str]] = {
            "robotmode": lambda: f"Robotmode: {RobotMode(self._get('robot_mode')).name}",
            "safetystatus": lambda: f"Safetystatus: {self._safety.name}",
            "safetymode": lambda: f"Safetymode: {self._safety.name}",
            "programstate": lambda: f"{self._state} {self.loaded or '<unnamed>'}",
            "running": lambda: f"Program running: {str(self._state == 'PLAYING').lower()}",
            "isprogramsaved": lambda: f"true {self.loaded or '<unnamed>'}",
            "get loaded program": lambda: (
                f"Loaded program: {DIRECTORY}{self.loaded}" if self.loaded else "No program loaded"
            ),
            "is in remote control": lambda: str(self.remote).lower(),
            "polyscopeversion": lambda: f"URSoftware {controller.version}.0 (Jan 01 2022)",
            "get robot model": lambda: "UR5",
            "close popup": lambda: "closing popup",
            "close safety popup": lambda: "closing safety popup",
            "quit": lambda: "Disconnected",
        }

    @property
    def knows_local_control(self) -> bool:
        """Whether the series has a switch between local and remote control."""
        return self._controller.series is Series.E

    def answer(self, line: str, *, allowed: bool) -> str:
        """The answer to a line of a client. `allowed`: its connection was opened in remote control."""
        said = " ".join(line.split())
        word = said.lower()
        if not self._is_known(word):
            return f"could not understand: '{said}'"
        if word in self._acts or word.startswith("load "):
            if self.knows_local_control and not (allowed and self.remote):
                return LOCAL
            return self._acts[word]() if word in self._acts else self._load(said.partition(" ")[2])
        if word in self._tells:
            return self._tells[word]()
        return "showing popup" if word.startswith("popup ") else "Added log message"

    def is_question(self, line: str) -> bool:
        """Whether a line asks for something that changes nothing."""
        return " ".join(line.split()).lower() in self._tells

    def _is_known(self, word: str) -> bool:
        since = _SINCE.get(word)
        if since is not None:
            first = since.get(self._controller.series)
            return first is not None and self._controller.version >= first
        return word in self._acts or word in self._tells or word.startswith(("load ", "popup ", "addtolog "))

    def _run(self, command: str, done: str) -> str:
        if self.loaded is None:
            return f"Failed to execute: {command}"
        try:
            self._controller.modes.run_program(command)
        except ModeError:
            return f"Failed to execute: {command}"
        return done

    def _load(self, name: str) -> str:
        file = name.removeprefix(DIRECTORY)
        if file not in self.programs:
            return f"File not found: {name}"
        if self._state != "STOPPED":
            return f"Error while loading program: {name}"
        self.loaded = file
        return f"Loading program: {name}"

    def _power(self, command: str, done: str) -> str:
        # A robot that is on, or cannot be switched on now, gives the same answer; its mode shows what came of it.
        try:
            self._controller.modes.switch_power(command)
        except ModeError:
            return done
        return done

    def _release(self) -> str:
        is_off = self._get("robot_mode") == RobotMode.POWER_OFF
        return self._power("start" if is_off else "release", "Brake releasing")

    def _unlock(self) -> str:
        if self._safety is not SafetyStatus.PROTECTIVE_STOP:
            return "Protective stop releasing"
        try:
            self._controller.modes.set_safety("normal")
        except ModeError:
            return TOO_SOON
        return "Protective stop releasing"

    @property
    def _state(self) -> str:
        return _STATES.get(ProgramState(self._get("runtime_state")), "STOPPED")

    @property
    def _safety(self) -> SafetyStatus:
        return SafetyStatus(self._get("safety_status"))

    def _get(self, field: str) -> int:
        return int(self._controller.get(field)[0])

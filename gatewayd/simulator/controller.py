"""The controller behind the protocol: cycle counter, variables, claims, robot program. No sockets, no clock.

Its owner calls `advance` for every control cycle; everything it shows follows from the number of cycles, from
what was written and from the switches in `faults`.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Hashable, Iterable, Sequence

from gatewayd.rtde.enums import ProgramState
from gatewayd.rtde.fields import INPUTS, OUTPUTS, Field, Series, SoftwareVersion
from gatewayd.rtde.messages import PropertiesReply
from gatewayd.rtde.types import DataType
from gatewayd.simulator.arm import DRIVEN, ControllerMoment
from gatewayd.simulator.claims import ControllerClaims
from gatewayd.simulator.faults import ADAPTER_FIELDS, ADAPTERS, Faults
from gatewayd.simulator.interpreter import Interpreter
from gatewayd.simulator.kinematics import ARMS, MODELS, Vector, geometry
from gatewayd.simulator.modes import RobotModes
from gatewayd.simulator.program import ProgramRule
from gatewayd.simulator.properties import PROPERTIES_SINCE, answer_properties
from gatewayd.simulator.signals import CYCLE_FIELDS, INITIAL, SIGNALS
from gatewayd.simulator.store import FieldStore, Scalar

DEFAULT_VERSIONS = {
    Series.CB3: SoftwareVersion(3, 15, 8),
    Series.E: SoftwareVersion(5, 12, 0),
    Series.X: SoftwareVersion(10, 12, 0),
}
"""Software that each series runs by default."""

DEFAULT_UPTIME = 100.0
"""Seconds since power-up at the start: beyond the boot window that clients wait out."""

INTERNAL = "the controller itself"
"""Owner of the inputs that were claimed with `hold`."""

CREEP = 1e-9
"""Seconds by which a timestamp that creeps goes on in a cycle."""
_POSTURES = ("actual_q", "target_q")  # setting one of them moves the arm there


class Controller:
    """One simulated controller.

    `frequency` is the rate of its control cycle in Hz (default: that of the series), `uptime` its first timestamp in
    seconds. `model` is the size of the arm, one of `MODELS`. `fields` are outputs that the catalogue does not have, or
    has with another type; they rest at zero. `replayed`: the outputs are those of a recording and `fields`, and nothing
    moves or runs by itself. Raises ProgramError if `program` names what the controller does not have,
    ValueError for inputs to be held that do not exist, for an unknown model, and for fields that are inputs or tell
    the time.
    """

    def __init__(
        self,
        series: Series = Series.E,
        version: SoftwareVersion | None = None,
        *,
        frequency: float | None = None,
        uptime: float | None = None,
        program: Iterable[ProgramRule] = (),
        faults: Faults | None = None,
        fields: Iterable[Field] = (),
        model: str = "ur5e",
        replayed: Collection[str] | None = None,
    ) -> None:
        self.series = series
        self.version = version or DEFAULT_VERSIONS[series]
        """Software version: fields that came later are NOT_FOUND."""
        self.faults = faults or Faults()
        """The fault switches; they may be thrown at any time."""
        self.rate = float(frequency or series.base_rate)
        """Control cycles per second."""
        self.cycle = 0
        """Cycles run. Unlike the step counter it goes on while the controller is frozen."""
        self.claims = ControllerClaims()
        own = {field.name: field for field in fields}
        self._own = own.keys()
        taken = own.keys() & (INPUTS.keys() | CYCLE_FIELDS)
        if taken:
            message = f"{min(taken)} cannot be another field"
            raise ValueError(message)
        self._outputs = {**OUTPUTS, **own}
        self._replayed = replayed
        self.quiet = False
        """Whether there is nothing to send in this cycle."""
        still = own.keys() | set(replayed or ())
        signals = {name: signal for name, signal in SIGNALS.items() if name not in still}
        initial = {name: value for name, value in INITIAL.items() if name not in own}
        types = {name: field.type for name, field in {**INPUTS, **self._outputs}.items()}
        self.store = FieldStore(types, signals, initial)
        if model not in MODELS:
            message = f"no arm {model!r}; there are: {', '.join(MODELS)}"
            raise ValueError(message)
        self._arm = ARMS[model]
        self._posture: Vector | None = None
        self._overwritten: dict[str, tuple[Scalar, ...]] = {}
        self._rules = tuple(program)
        self._interpreter = self._load()
        if uptime is None:
            uptime = DEFAULT_UPTIME if self.faults.boot_restart is None else 0.0
        self._boot(round(uptime * self.rate))
        self._holders: set[Hashable] = {INTERNAL, *ADAPTERS.values()}
        if self.faults.adapter is not None:
            taken_by_it = [name for name in ADAPTER_FIELDS if self.input_type(name)]
            self.claims.claim(ADAPTERS[self.faults.adapter], taken_by_it)
        self.hold(self.faults.hold)

    @property
    def step(self) -> int:
        """The step counter: timestamp times rate."""
        return self.store.moment.step

    def output_type(self, name: str) -> DataType | None:
        """The type of an output, None if this series and version does not have it, or by a fault."""
        if name in self.faults.unreadable or not self._shows(name):
            return None
        return self._type(self._outputs.get(name))

    def input_type(self, name: str) -> DataType | None:
        """The type of an input, None if this series and version does not have it."""
        return self._type(INPUTS.get(name))

    def period(self, frequency: float | None) -> int:
        """Cycles from one package to the next: floor(rate / frequency), never more often than each cycle.

        None is a request in protocol version 1, which gets 125 Hz; 0 and nonsense get the full rate, less than 1 Hz
        gets 1 Hz.
        """
        if frequency is None:
            frequency = Series.CB3.base_rate
        if not 0 < frequency < self.rate:
            return 1
        return int(self.rate / max(frequency, 1.0))

    def properties(self, names: tuple[str, ...]) -> PropertiesReply | None:
        """The answer to a question for properties; None: the software does not know the question."""
        first = PROPERTIES_SINCE.get(self.series)
        if first is None or self.version < first:
            return None
        return answer_properties(names, self.version)

    def advance(self, cycles: int = 1) -> None:
        """Run one control cycle, `cycles` after the last: more than 1 where some could not be run in time."""
        self.cycle += cycles
        self.enforce()
        if self.faults.creep:
            moment = self.store.moment
            self.store.moment = moment._replace(time=moment.time + CREEP)
        if self.faults.freeze or self.faults.creep:
            return
        if self._replayed is not None:
            self._boot(self.step + cycles)
            return
        self.modes.advance(cycles)
        before = self.store.moment
        fraction = self._fraction() * self.modes.share if self.modes.power == DRIVEN else 0.0
        elapsed = cycles / self.rate
        path = before.path + (before.rate + fraction) / 2 * elapsed
        # A program stopped by a write to `runtime_state` stands at once; only a sequence of modes brakes.
        change = (fraction - before.rate) / elapsed if self.modes.gliding else 0.0
        step = self.step + cycles
        self._set_step(step, step / self.rate, path, fraction, change)
        if int(self.store.cells[self._state]) == ProgramState.RUNNING:
            self._interpreter.run(cycles)

    def enforce(self) -> None:
        """Write what is overwritten in every cycle."""
        for field, values in self._overwritten.items():
            if self.get(field) != values:
                self.store.write(field, values)

    def restart(self) -> None:
        """Boot again: timestamp and registers from the beginning, no claims but internal ones, nothing overwritten."""
        self._overwritten.clear()
        self.store.reset()
        self._posture = None
        self._interpreter = self._load()
        self._boot(0)

    def hold(self, fields: Iterable[str], holder: str = INTERNAL) -> None:
        """Claim inputs for `holder`: the controller itself, or a client that has no connection here.

        ValueError names those that do not exist or are somebody else's.
        """
        wanted = tuple(fields)
        unknown = [name for name in wanted if self.input_type(name) is None]
        if unknown:
            message = f"no such input: {', '.join(unknown)}"
            raise ValueError(message)
        taken = self.claims.claim(holder, wanted)
        self._holders.add(holder)
        if taken:
            name = min(taken)
            message = f"{name} is in use by {self.claims.owner(name)}"
            raise ValueError(message)

    def free(self, fields: Iterable[str]) -> None:
        """Give up inputs that `hold` or an adapter has claimed; ValueError for what nobody or a connection holds."""
        for name in tuple(fields):
            owner = self.claims.owner(name)
            if owner not in self._holders:
                message = f"{name} is not held" if owner is None else f"{name} is in use by {owner}"
                raise ValueError(message)
            self.claims.release(owner, (name,))

    def get(self, field: str) -> tuple[Scalar, ...]:
        """The elements of any input or output now; KeyError if there is no such field."""
        return self.store.read(field)

    def set(self, field: str, values: Sequence[Scalar]) -> None:
        """Write any field, as the robot would; one that moves by itself stays there from now on.

        Joint angles take the arm along: it stands at `actual_q` or `target_q`, and its pose follows. KeyError if there
        is no such field, ValueError for the wrong number of values or the cycle counter.
        """
        self.check(field, values)
        if field in _POSTURES:
            self._posture = tuple(float(value) if math.isfinite(value) else 0.0 for value in values)
            self._set_step(*self.store.moment[:4])
            return
        self.store.pin(field, values)

    def check(self, field: str, values: Sequence[Scalar]) -> None:
        """Raise what `set` would raise, and set nothing."""
        if field in CYCLE_FIELDS:
            message = f"{field} follows the controller's cycles; use freeze to stop it"
            raise ValueError(message)
        self.store.check(field, values)

    def overwrite(self, field: str, values: Sequence[Scalar] | None) -> None:
        """Write a field as `set` does, and in every cycle again, whatever clients send; None: no more.

        KeyError and ValueError as `set`.
        """
        if values is None:
            self._overwritten.pop(field, None)
            return
        self.set(field, values)
        self._overwritten[field] = self.get(field)

    def _type(self, field: Field | None) -> DataType | None:
        return field.type if field is not None and field.available(self.series, self.version) else None

    def _shows(self, name: str) -> bool:
        """Whether a controller that is replayed has this output: recorded, declared, an input's, or the time."""
        replayed = self._replayed
        return (
            replayed is None or name in replayed or name in self._own or name in INPUTS or name == "timestamp"
        )

    def _load(self) -> Interpreter:
        self._speed = self.store.place("target_speed_fraction").start
        self._state = self.store.place("runtime_state").start
        self._tool = self.store.place("tcp_offset")
        self.modes = RobotModes(self.store, self.rate)
        """Power, safety and program, by commands."""
        return Interpreter(self._rules, self.store, self.rate, INPUTS)

    def _fraction(self) -> float:
        """Share of full speed; whatever else was written there means full speed."""
        fraction = float(self.store.cells[self._speed])
        return fraction if 0 <= fraction <= 1 else 1.0

    def _boot(self, step: int) -> None:
        self._set_step(step, step / self.rate, 0.0, self.modes.share)

    def _set_step(self, step: int, time: float, path: float, rate: float, change: float = 0.0) -> None:
        tool = tuple(self.store.cells[self._tool])
        if tool != self._arm.tool and all(map(math.isfinite, tool)):
            self._arm = geometry(self._arm.model, tool)
        power = self.modes.power
        self.store.moment = ControllerMoment(step, time, path, rate, change, power, self._arm, self._posture)

"""The client's part of an RTDE conversation as a table: which message comes next after which answer.

Pure: messages in, messages out. The order is version 2 (else 1), controller version, outputs, inputs, start. Text
messages are the caller's; data packages are told to the negotiation only while it waits for a start, which
they prove (a controller may send data before the answer to a start, or instead of it).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum, auto
from typing import ClassVar, NamedTuple

from gatewayd.rtde.catalogue import OUTPUTS, Series, likely_holders
from gatewayd.rtde.claims import OLD_LIST_LIMIT, Claims, HandshakeError, InputRecipe, sort_types
from gatewayd.rtde.messages import (
    IN_USE,
    NOT_FOUND,
    ControllerMessage,
    ControllerVersion,
    DataPackage,
    ExecutableMessage,
    GetControllerVersion,
    InputsSetup,
    OutputsSetup,
    Pause,
    PauseReply,
    ProtocolVersionReply,
    RequestProtocolVersion,
    SetupOutputs,
    Start,
    StartReply,
)
from gatewayd.rtde.recipe import Recipe

__all__ = [
    "TIMESTAMP",
    "TOO_LONG",
    "Event",
    "Negotiation",
    "Session",
    "State",
    "Step",
    "Unavailable",
    "Wishes",
]

TIMESTAMP = "timestamp"
"""The output that is always subscribed, first: it tells skipped and late packages, and a restarted controller."""
TOO_LONG = "TOO_LONG"
"""Our word for a read-back that was left out because the controller does not take so long a list of names."""

_RATE_V1 = 125
_RATE_UNKNOWN = {True: 500, False: 125}
_NEW_HARDWARE = 5


@dataclass(frozen=True, slots=True)
class Wishes:
    """What a client wants of a controller."""

    outputs: tuple[str, ...] = ()
    """Fields to subscribe; `timestamp` is put first by itself."""
    inputs: tuple[str, ...] = ()
    """Fields to claim."""
    watchdog: str | None = None
    """Input field that gets a recipe of its own; need not be in `inputs`."""
    frequency: float = 0.0
    """Output packages per second; 0: as many as the controller makes."""
    read_back: bool = True
    """Subscribe the wanted `input_*` fields too, after the outputs."""
    short_outputs: bool = False
    """Leave the read-backs out all the same: the controller does not take the whole list."""
    short_inputs: bool = False
    """Claim the registers by several lists of at most `OLD_LIST_LIMIT` bytes instead of one."""
    running: bool = True
    """Start the output; else stay paused."""

    def wanted_inputs(self) -> tuple[str, ...]:
        """Fields to claim, the watchdog included."""
        return tuple(dict.fromkeys((*self.inputs, *((self.watchdog,) if self.watchdog else ()))))

    def read_backs(self) -> tuple[str, ...]:
        """Inputs that the controller also offers as outputs and that are not subscribed anyway."""
        return tuple(
            name
            for name in self.wanted_inputs()
            if name.startswith("input_") and name in OUTPUTS and name not in self.outputs
        )

    def subscription(self) -> tuple[str, ...]:
        """Everything to subscribe, in order, each once."""
        read_backs = self.read_backs() if self.read_back and not self.short_outputs else ()
        names = (TIMESTAMP, *self.outputs, *read_backs)
        return tuple(dict.fromkeys(names))


@dataclass(frozen=True, slots=True)
class Unavailable:
    """A field that the controller does not give."""

    field: str
    output: bool
    """Wanted as output; else as input."""
    word: str
    """The controller's word: NOT_FOUND, IN_USE, a type unknown to us; or REFUSED, TOO_LONG."""
    hint: str
    """What it means, who may be behind it."""


@dataclass(frozen=True, slots=True)
class Session:
    """What was agreed with the controller. A new object whenever the inputs change."""

    controller: ControllerVersion
    series: Series | None
    """None for a major software version that we do not know."""
    protocol: int
    """RTDE protocol version spoken."""
    period: float
    """Seconds between packages, as the controller divides its own rate."""
    outputs: Recipe
    """Layout of the values; `timestamp` is its first field unless the controller lacks it."""
    inputs: Mapping[str, InputRecipe]
    """Claimed inputs by recipe key (`gatewayd.rtde.claims.recipe_key`)."""
    unavailable: tuple[Unavailable, ...]


class State(Enum):
    """What is awaited; the value completes "waiting for ..."."""

    NEW = "the first message"
    VERSION_2 = "the answer to protocol version 2"
    VERSION_1 = "the answer to protocol version 1"
    CONTROLLER = "the controller version"
    OUTPUTS = "the answer to the output recipe"
    INPUTS = "the answer to an input recipe"
    STARTING = "the answer to the start"
    RUNNING = "data"
    PAUSING = "the answer to the pause"
    PAUSED = "nothing, being paused"
    RESUMING = "the answer to the restart"


class Event(Enum):
    """Something to tell the user of the client."""

    STARTED = auto()
    INPUTS_CHANGED = auto()
    PAUSED = auto()
    RESUMED = auto()


class Step(NamedTuple):
    """What follows from a message."""

    send: ExecutableMessage | None = None
    event: Event | None = None


_NOTHING = Step()
_AT_REST = frozenset({State.RUNNING, State.PAUSED})


class Negotiation:
    """One conversation. `begin` once, then `handle` for every answer. HandshakeError when it cannot go on."""

    def __init__(self, wishes: Wishes) -> None:
        self.state = State.NEW
        """What is awaited."""
        limit = OLD_LIST_LIMIT if wishes.short_inputs else None
        self.claims = Claims(wishes.wanted_inputs(), wishes.watchdog, limit)
        """The inputs."""
        self._wishes = wishes
        self._run = wishes.running
        self._names = wishes.subscription()
        self._refused_outputs: dict[str, str] = {}
        self._version = 1
        self._controller: ControllerVersion | None = None
        self._outputs: Recipe | None = None
        self._period = 1 / _RATE_V1

    @property
    def running(self) -> bool:
        """Whether data is due."""
        return self.state is State.RUNNING

    @property
    def waiting(self) -> bool:
        """Whether an answer is due."""
        return self.state not in _AT_REST or self.claims.busy

    @property
    def awaited(self) -> str:
        """The answer that is due, in words."""
        return (State.INPUTS if self.state in _AT_REST else self.state).value

    def begin(self) -> ExecutableMessage:
        """The first message."""
        self.state = State.VERSION_2
        return RequestProtocolVersion(2)

    def handle(self, message: ControllerMessage) -> Step:
        """Take an answer; a data package out of season is no matter."""
        action = self._TABLE.get((self.state, type(message)))
        if action is not None:
            return action(self, message)
        if isinstance(message, DataPackage):
            return _NOTHING
        msg = f"the controller sent {type(message).__name__} while {self.state.value} was awaited"
        raise HandshakeError(msg)

    def retry_claims(self) -> ExecutableMessage | None:
        """Ask again for inputs that were in use, if any are and no answer is due."""
        if self.waiting:
            return None
        self.claims.retry()
        return self.claims.request()

    def pause(self) -> ExecutableMessage | None:
        """Stop the output: at once, or as soon as the negotiation gets there (then None)."""
        self._run = False
        if self.state is not State.RUNNING:
            return None
        self.state = State.PAUSING
        return Pause()

    def resume(self) -> ExecutableMessage | None:
        """Start the output again: at once, or as soon as the negotiation gets there (then None)."""
        self._run = True
        if self.state is not State.PAUSED:
            return None
        self.state = State.RESUMING
        return Start()

    def session(self) -> Session:
        """What has been agreed. Only after `Event.STARTED`."""
        assert self._controller is not None
        assert self._outputs is not None
        return Session(
            self._controller,
            Series.from_major(self._controller.major),
            self._version,
            self._period,
            self._outputs,
            self.claims.recipes,
            self._unavailable(),
        )

    # what to do with each answer

    def _version_2_answered(self, reply: ProtocolVersionReply) -> Step:
        if reply.accepted:
            self._version = 2
            return self._go(State.CONTROLLER, GetControllerVersion())
        return self._go(State.VERSION_1, RequestProtocolVersion(1))

    def _version_1_answered(self, reply: ProtocolVersionReply) -> Step:
        if not reply.accepted:
            raise HandshakeError("the controller speaks neither protocol version 2 nor 1")
        return self._go(State.CONTROLLER, GetControllerVersion())

    def _controller_answered(self, version: ControllerVersion) -> Step:
        self._controller = version
        return self._ask_outputs(version)

    def _ask_outputs(self, version: ControllerVersion) -> Step:
        if self._version == 1:
            return self._go(State.OUTPUTS, SetupOutputs(self._names))
        series = Series.from_major(version.major)
        rate = series.base_rate if series else _RATE_UNKNOWN[version.major >= _NEW_HARDWARE]
        frequency = min(max(self._wishes.frequency, 1.0), rate) if self._wishes.frequency else float(rate)
        self._period = (rate // frequency) / rate
        return self._go(State.OUTPUTS, SetupOutputs(self._names, frequency))

    def _outputs_answered(self, reply: OutputsSetup) -> Step:
        assert self._controller is not None
        types, refused = sort_types(self._names, reply.types)
        if refused:
            self._refused_outputs.update(refused)
            self._names = tuple(name for name in self._names if name not in refused)
            if not self._names:
                raise HandshakeError("the controller offers none of the wanted outputs")
            return self._ask_outputs(self._controller)
        if reply.recipe == 0:
            raise HandshakeError("the controller refused the output recipe without naming a field")
        self._outputs = Recipe(self._names, types)
        return self._ask_inputs()

    def _ask_inputs(self) -> Step:
        request = self.claims.request()
        if request is not None:
            return self._go(State.INPUTS, request)
        self.claims.take_change()
        if self._run:
            return self._go(State.STARTING, Start())
        return self._go(State.PAUSED, None, Event.STARTED)

    def _inputs_answered(self, reply: InputsSetup) -> Step:
        self.claims.answer(reply)
        return self._ask_inputs()

    def _more_inputs_answered(self, reply: InputsSetup) -> Step:
        self.claims.answer(reply)
        request = self.claims.request()
        changed = request is None and self.claims.take_change()
        return Step(request, Event.INPUTS_CHANGED if changed else None)

    def _started(self, message: StartReply | DataPackage) -> Step:
        if isinstance(message, StartReply) and not message.accepted:
            raise HandshakeError("the controller refused to start the output")
        event = Event.STARTED if self.state is State.STARTING else Event.RESUMED
        if not self._run:
            return self._go(State.PAUSING, Pause(), event)
        return self._go(State.RUNNING, None, event)

    def _started_late(self, message: StartReply) -> Step:
        if not message.accepted:
            raise HandshakeError("the controller refused to start the output")
        return _NOTHING

    def _paused(self, _: PauseReply) -> Step:
        if self._run:
            return self._go(State.RESUMING, Start(), Event.PAUSED)
        return self._go(State.PAUSED, None, Event.PAUSED)

    def _go(self, state: State, send: ExecutableMessage | None, event: Event | None = None) -> Step:
        self.state = state
        return Step(send, event)

    def _unavailable(self) -> tuple[Unavailable, ...]:
        outputs = [
            Unavailable(name, True, word, _output_hint(word)) for name, word in self._refused_outputs.items()
        ]
        if self._wishes.read_back and self._wishes.short_outputs:
            outputs += [
                Unavailable(name, True, TOO_LONG, _output_hint(TOO_LONG))
                for name in self._wishes.read_backs()
            ]
        inputs = [
            Unavailable(name, False, word, _input_hint(name, word))
            for name, word in self.claims.refused.items()
        ]
        return (*outputs, *inputs)

    _TABLE: ClassVar[Mapping[tuple[State, type], Callable[..., Step]]] = {
        (State.VERSION_2, ProtocolVersionReply): _version_2_answered,
        (State.VERSION_1, ProtocolVersionReply): _version_1_answered,
        (State.CONTROLLER, ControllerVersion): _controller_answered,
        (State.OUTPUTS, OutputsSetup): _outputs_answered,
        (State.INPUTS, InputsSetup): _inputs_answered,
        (State.STARTING, StartReply): _started,
        (State.STARTING, DataPackage): _started,
        (State.RUNNING, StartReply): _started_late,
        (State.RUNNING, InputsSetup): _more_inputs_answered,
        (State.PAUSING, StartReply): _started_late,
        (State.PAUSING, InputsSetup): _more_inputs_answered,
        (State.PAUSING, PauseReply): _paused,
        (State.PAUSED, InputsSetup): _more_inputs_answered,
        (State.RESUMING, StartReply): _started,
        (State.RESUMING, DataPackage): _started,
        (State.RESUMING, InputsSetup): _more_inputs_answered,
    }
    """State and kind of answer -> what to do with it; everything else is out of place."""


def _output_hint(word: str) -> str:
    if word == NOT_FOUND:
        return "this controller's software does not have the field"
    if word == TOO_LONG:
        return "left out because the controller did not take so long a list of outputs"
    return f"the controller names a type that is not known here: {word}"


def _input_hint(name: str, word: str) -> str:
    if word == IN_USE:
        return f"probably claimed by {likely_holders(name)}"
    if word == NOT_FOUND:
        return "this controller's software does not have the input"
    return f"the controller answered {word}"

"""A controller without sockets that answers messages: the naive second model for tests of the client's negotiation."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from gatewayd.rtde import messages as m
from gatewayd.rtde.fields import INPUTS, OUTPUTS
from gatewayd.rtde.negotiation import Negotiation
from gatewayd.rtde.recipe import Recipe, Scalar
from gatewayd.rtde.session import Session
from gatewayd.rtde.steps import NextStep, Notice
from gatewayd.rtde.types import DataType

E_SERIES = m.ControllerVersion(5, 12, 0, 1101)


@dataclass
class PureController:
    """Answers what it is asked; `stray` draws how many packages come before and after each answer."""

    limit: int = 65535
    in_use: set[str] = field(default_factory=set)
    unreadable: set[str] = field(default_factory=set)
    stray: Callable[[], int] = lambda: 0
    swallows_start: bool = False
    """Packages come in place of the answer to a start."""
    held: dict[str, Scalar] = field(default_factory=dict)
    lists: list[tuple[str, ...]] = field(default_factory=list)
    recipes: list[tuple[str, ...]] = field(default_factory=list)
    outputs: Recipe | None = None
    running: bool = False
    step: int = 0
    out: deque[m.ControllerMessage] = field(default_factory=deque)

    def value(self, name: str) -> Scalar:
        return self.held.get(name, 0)

    def package(self) -> None:
        if not self.running or self.outputs is None:
            return
        self.step += 1
        flat: list[Scalar] = []
        for name, kind in zip(self.outputs.names, self.outputs.types, strict=True):
            flat += [float(self.step) if name == "timestamp" else self.value(name)] * kind.count
        self.out.append(m.DataPackage(1, self.outputs.pack(flat)))

    def packages(self) -> None:
        for _ in range(self.stray()):
            self.package()

    def ask(self, message: m.ExecutableMessage) -> None:
        self.packages()
        match message:
            case m.RequestProtocolVersion():
                self.out.append(m.ProtocolVersionReply(True))
            case m.GetControllerVersion():
                self.out.append(E_SERIES)
            case m.SetupOutputs(names, _):
                self._set_up_outputs(names)
            case m.SetupInputs(names):
                self._set_up_inputs(names)
            case m.Start():
                self.running = self.outputs is not None
                if self.swallows_start:
                    self.package()
                else:
                    self.packages()
                    self.out.append(m.StartReply(self.running))
            case m.Pause():
                self.running = False
                self.out.append(m.PauseReply(True))
        self.packages()

    def write(self, number: int, values: list[Scalar]) -> None:
        self.held |= zip(self.recipes[number - 1], values, strict=True)

    def _set_up_outputs(self, names: tuple[str, ...]) -> None:
        self.lists.append(names)
        words = [
            m.NOT_FOUND if name in self.unreadable or name not in OUTPUTS else OUTPUTS[name].type.word
            for name in names
        ]
        good = m.NOT_FOUND not in words and len(",".join(names)) <= self.limit
        self.outputs = Recipe(names, [DataType.from_word(word) for word in words]) if good else None
        self.out.append(m.OutputsSetup(int(good), tuple(words)))

    def _set_up_inputs(self, names: tuple[str, ...]) -> None:
        self.lists.append(names)
        words = [m.IN_USE if name in self.in_use else INPUTS[name].type.word for name in names]
        good = m.IN_USE not in words and len(",".join(names)) <= self.limit
        if good:
            self.recipes.append(names)
        self.out.append(m.InputsSetup(len(self.recipes) if good else 0, tuple(words)))


class Conversation:
    """A negotiation and such a controller; what a connection does with them, without its clocks."""

    def __init__(self, negotiation: Negotiation, controller: PureController) -> None:
        self.negotiation = negotiation
        self.controller = controller
        self.events: list[Notice] = []
        self.sessions: list[Session] = []
        self.shown: list[dict[str, Scalar]] = []
        """The inputs that each session has made known by readings and its first package."""
        self._reads = False
        self.say(negotiation.begin())

    def say(self, message: m.ExecutableMessage | None) -> None:
        if message is not None:
            self.controller.ask(message)

    def settle(self) -> None:
        """Talk until nothing is due but a package of the working recipe."""
        for _ in range(2000):
            if not self.controller.out:
                if not self.negotiation.waiting and not self._reads:
                    return
                self.controller.package()
                if not self.controller.out:
                    assert not self.negotiation.waiting
                    return
            self.hear(self.controller.out.popleft())
        raise AssertionError(self.negotiation.state)

    def hear(self, message: m.ControllerMessage) -> None:
        if not (isinstance(message, m.DataPackage) and self.negotiation.running):
            self._follow(self.negotiation.handle(message))
        if isinstance(message, m.DataPackage) and self.negotiation.delivering:
            session = self.sessions[-1]
            values = session.outputs.unpack(message.payload)
            if self._reads:
                self._reads = False
                slots = session.outputs.slots
                self.shown[-1] |= {
                    name: values[slots[name]][0] for name in self.negotiation.claims.types if name in slots
                }

    def _follow(self, step: NextStep) -> None:
        if step.event is not None:
            self.events.append(step.event)
        if step.event in {Notice.STARTED, Notice.INPUTS_CHANGED}:
            session = self.negotiation.session()
            self.sessions.append(session)
            self.shown.append({name: values[0] for name, values in session.held.items()})
            self._reads = True
        self.say(step.send)

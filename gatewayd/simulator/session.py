"""One client's connection, as the controller sees it: packages in, packages out. No sockets, no clock.

What the guides leave open is decided as in the public clients' experience: inputs need no START, a second output
recipe replaces the first at once, what is not laid out as its type says is complained of in a text message, and a type
that the controller does not know is met with silence.
"""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from gatewayd.rtde import messages
from gatewayd.rtde.catalogue import OLD_LIST_LIMIT, is_long, list_size
from gatewayd.rtde.claims import MAX_RECIPES
from gatewayd.rtde.codec import MAX_PACKAGE, ControllerProtocol, ProtocolError
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.strange import Oddity, StrangeCounts, StrangePackage
from gatewayd.rtde.types import DataType
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.faults import DroppedError, FaultStep, LongLists
from gatewayd.simulator.masks import Effect, effects
from gatewayd.simulator.store import FieldStore, RecipeView

SOURCE = "URControl"
"""Source of the controller's text messages."""

_OUTPUT_RECIPE = 1
_DATA_HEAD = 4
_STEPS: Mapping[type, FaultStep] = {
    messages.RequestProtocolVersion: FaultStep.VERSION,
    messages.GetControllerVersion: FaultStep.CONTROLLER,
    messages.SetupOutputs: FaultStep.OUTPUTS,
    messages.SetupInputs: FaultStep.INPUTS,
    messages.Start: FaultStep.START,
    messages.Pause: FaultStep.PAUSE,
    messages.DataPackage: FaultStep.WRITE,
}
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class _InputRecipe:
    """The way from an input package into the store."""

    recipe: Recipe
    cells: tuple[int, ...]
    effects: tuple[Effect, ...]

    def apply(self, payload: bytes, store: FieldStore) -> None:
        """ProtocolError if the payload has not the recipe's length; nothing is written then."""
        cells = store.cells
        for cell, value in zip(self.cells, self.recipe.unpack(payload), strict=True):
            cells[cell] = value
        store.edition += 1
        for effect in self.effects:
            effect(store)


class SimulatorSession:
    """The protocol state of one connection. Owner of its claims; `str` names it in the log."""

    def __init__(self, controller: Controller, name: str) -> None:
        self._controller = controller
        self._name = name
        self._protocol = ControllerProtocol()
        self._inputs: list[_InputRecipe] = []
        self._view: RecipeView | None = None
        self._period = 1
        self._started = False
        self._strange = StrangeCounts()
        self._steps: Counter[FaultStep] = Counter()
        self._out: list[bytes] = []

    def __str__(self) -> str:
        return self._name

    @property
    def streaming(self) -> bool:
        """Whether the client has started its output recipe."""
        return self._started and self._view is not None

    def greeting(self) -> bytes:
        """What is sent before anything was asked."""
        text = self._controller.faults.text_on_connect
        return b"" if text is None else self.text(text)

    def text(self, message: str) -> bytes:
        """A warning to the client, in the layout of the version it speaks."""
        return self._protocol.send(messages.TextMessage(message, SOURCE, messages.TextLevel.WARNING))

    def receive(self, data: bytes) -> bytes:
        """The answers to `data`, in order. ProtocolError for bytes that are no packages, DroppedError for a fault.

        What was answered before the offending bytes is lost with the connection, as on a real controller.
        """
        for message in self._protocol.receive(data):
            if isinstance(message, StrangePackage):
                self._pass_over(message)
            else:
                self._handle(message)
        out = b"".join(self._out)
        self._out.clear()
        return out

    def package(self) -> bytes:
        """The data package of this cycle; empty if none is due. Raises DroppedError for a fault."""
        controller = self._controller
        if not self.streaming or self._view is None or controller.faults.silence or controller.quiet:
            return b""
        if controller.cycle % self._period:
            return b""
        self._pass(FaultStep.DATA)
        return self._protocol.send(messages.DataPackage(_OUTPUT_RECIPE, self._view.payload()))

    def close(self) -> None:
        """Give up every claim."""
        self._controller.claims.release(self)

    def _pass(self, step: FaultStep) -> None:
        self._steps[step] += 1
        if self._controller.faults.drops(step, self._steps[step]):
            message = f"fault at {step.value}:{self._steps[step]}"
            raise DroppedError(message)

    def _pass_over(self, package: StrangePackage) -> None:
        if package.oddity is not Oddity.UNKNOWN_TYPE:
            self._complain(package.reason)
        elif self._strange.count(package):
            _log.info("%s: %s, not answered", self, package.reason)

    def _handle(self, message: messages.ExecutableMessage) -> None:
        step = _STEPS.get(type(message))
        if step is not None:
            self._pass(step)
        match message:
            case messages.DataPackage():
                self._data(message)
            case messages.SetupOutputs():
                self._setup_outputs(message)
            case messages.SetupInputs():
                self._setup_inputs(message)
            case messages.RequestProtocolVersion():
                newest = 1 if self._controller.faults.v1_only else 2
                self._answer(messages.ProtocolVersionReply(1 <= message.version <= newest))
            case messages.GetControllerVersion():
                self._answer(messages.ControllerVersion(*self._controller.version, build=0))
            case messages.Start() | messages.Pause():
                self._run(message)
            case messages.ReadProperties(names):
                self._read_properties(names)
            case messages.TextMessage():
                _log.info("%s says (level %d) %s: %s", self, message.level, message.source, message.message)

    def _run(self, message: messages.Start | messages.Pause) -> None:
        if isinstance(message, messages.Pause):
            self._started = False
            self._answer(messages.PauseReply(accepted=True))
        else:
            self._started = self._view is not None
            self._answer(messages.StartReply(self._started))

    def _read_properties(self, names: tuple[str, ...]) -> None:
        """Answer with types and values, with types alone if some name has no value; older software is silent."""
        reply = self._controller.properties(names)
        if reply is None:
            kind = messages.PackageType.READ_PROPERTIES
            self._pass_over(StrangePackage(Oddity.UNKNOWN_TYPE, kind, f"unknown package type {kind:d}"))
        else:
            self._answer(reply)

    def _answer(self, message: messages.ControllerMessage) -> None:
        self._out.append(self._protocol.send(message))

    def _complain(self, message: str) -> None:
        _log.info("%s: %s", self, message)
        self._answer(messages.TextMessage(message, SOURCE, messages.TextLevel.ERROR))

    def _setup_outputs(self, message: messages.SetupOutputs) -> None:
        if not self._answers(message.names):
            return
        kinds = [self._controller.output_type(name) for name in message.names]
        types = tuple(kind.word if kind else messages.NOT_FOUND for kind in kinds)
        valid = self._recipe("output", message.names, types, kinds) is not None
        self._view = self._controller.store.view(message.names) if valid else None
        self._period = self._controller.period(message.frequency)
        self._reply(messages.OutputsSetup(_OUTPUT_RECIPE if valid else 0, types))

    def _setup_inputs(self, message: messages.SetupInputs) -> None:
        if not message.names:
            _log.info("%s: empty input recipe, not confirmed", self)
            return
        if not self._answers(message.names):
            return
        kinds = [self._controller.input_type(name) for name in message.names]
        taken = self._controller.claims.taken(self, message.names)
        types = tuple(
            messages.NOT_FOUND if kind is None else messages.IN_USE if name in taken else kind.word
            for name, kind in zip(message.names, kinds, strict=True)
        )
        self._reply(messages.InputsSetup(self._add_inputs(message.names, types, kinds), types))

    def _add_inputs(
        self, names: tuple[str, ...], types: Sequence[str], kinds: Sequence[DataType | None]
    ) -> int:
        """The id of the new recipe, its fields claimed; 0 and nothing claimed if it cannot be."""
        recipe = self._recipe("input", names, types, kinds)
        if recipe is None:
            return 0
        if len(self._inputs) >= MAX_RECIPES:
            self._complain(f"a connection has {MAX_RECIPES} input recipes at most")
            return 0
        self._controller.claims.claim(self, names)
        store = self._controller.store
        cells = [cell for name in names for cell in range(store.place(name).start, store.place(name).stop)]
        self._inputs.append(_InputRecipe(recipe, tuple(cells), effects(names)))
        return len(self._inputs)

    def _recipe(
        self, side: str, names: tuple[str, ...], types: Sequence[str], kinds: Sequence[DataType | None]
    ) -> Recipe | None:
        """The recipe of a setup request; None if it is refused."""
        if not types or not messages.ERROR_WORDS.isdisjoint(types) or self._is_too_long(names):
            return None
        recipe = Recipe(names, [kind for kind in kinds if kind is not None])
        if recipe.size + _DATA_HEAD <= MAX_PACKAGE:
            return recipe
        self._complain(f"the {side} recipe is larger than a data package")
        return None

    def _data(self, message: messages.DataPackage) -> None:
        number = message.recipe or 0
        if not 1 <= number <= len(self._inputs):
            self._complain(f"data package for unknown input recipe {number}")
            return
        try:
            self._inputs[number - 1].apply(message.payload, self._controller.store)
        except ProtocolError as error:
            self._complain(f"input recipe {number}: {error.reason}")

    def _answers(self, names: tuple[str, ...]) -> bool:
        """Whether a setup request with these names is answered; by id 0 if the list is too long all the same."""
        if not self._is_too_long(names):
            return True
        way = self._controller.faults.long_lists
        text = f"list of {list_size(names)} bytes is longer than {OLD_LIST_LIMIT}"
        if way is LongLists.CLOSE:
            raise DroppedError(text)
        if way is LongLists.COMPLAIN:
            self._complain(text)
        return way is LongLists.REFUSE

    def _is_too_long(self, names: tuple[str, ...]) -> bool:
        return self._controller.faults.long_lists is not LongLists.TAKE and is_long(names)

    def _reply(self, message: messages.OutputsSetup | messages.InputsSetup) -> None:
        """Answer a setup; a list of types too long for a package becomes a complaint."""
        try:
            self._answer(message)
        except ValueError:
            self._complain("the list of types is larger than a package")

"""Claiming controller inputs: which fields share a recipe, and what to ask for when some are refused.

Pure: requests out, answers in. A recipe with a refused field is refused whole, so the refused ones are left out and
the rest is asked for again; fields in use elsewhere are asked for again on `retry`, together with those already held,
so that a group always ends up in one recipe. A client may claim a field in several recipes; ids count 1 to 255.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

from gatewayd.rtde.messages import ERROR_WORDS, IN_USE, InputsSetup, SetupInputs
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.types import DataType

__all__ = [
    "OLD_LIST_LIMIT",
    "REFUSED",
    "REGISTERS_KEY",
    "WATCHDOG_KEY",
    "Claims",
    "HandshakeError",
    "InputRecipe",
    "recipe_key",
    "sort_types",
]

REGISTERS_KEY = "registers"
"""Key of the recipe that holds every general purpose register."""
WATCHDOG_KEY = "watchdog"
"""Key of the watchdog field's own recipe: whatever else is written must not feed it."""
REFUSED = "REFUSED"
"""Our word for fields whose recipe the controller refused without saying why."""

OLD_LIST_LIMIT = 2048
"""Bytes of a list of names that every controller takes (older guide, "Introduction"); newer ones take far more."""

_LAST_ID = 255
_RETRIED = frozenset({IN_USE, REFUSED})
_FAMILIES = (
    "speed_slider",
    "standard_digital_output",
    "configurable_digital_output",
    "tool_digital_output",
    "standard_analog_output",
)


class HandshakeError(Exception):
    """An answer that does not belong to what was asked, or a refusal that leaves nothing to go on with."""


def recipe_key(name: str) -> str:
    """The recipe an input field belongs to: values that must reach the robot together share one.

    The registers make one recipe. A mask and its values make one for each family, because sending the mask acts.
    """
    if name.startswith("input_"):
        return REGISTERS_KEY
    return next((family for family in _FAMILIES if name.startswith(family)), name)


def _parts(names: Sequence[str], limit: int | None) -> list[tuple[str, ...]]:
    """Split so that no part is longer than `limit` when joined by commas."""
    if limit is None:
        return [tuple(names)]
    parts: list[list[str]] = [[]]
    for name in names:
        if parts[-1] and len(",".join((*parts[-1], name))) > limit:
            parts.append([])
        parts[-1].append(name)
    return [tuple(part) for part in parts]


def sort_types(names: Sequence[str], words: Sequence[str]) -> tuple[list[DataType], dict[str, str]]:
    """The types of an answer to a setup request, and the words of the fields that are not available.

    A type word that we do not know counts as not available. HandshakeError if the numbers differ.
    """
    if len(words) != len(names):
        msg = f"the controller answered {len(words)} types for {len(names)} fields"
        raise HandshakeError(msg)
    types: list[DataType] = []
    refused: dict[str, str] = {}
    for name, word in zip(names, words, strict=True):
        if word in ERROR_WORDS:
            refused[name] = word
            continue
        try:
            types.append(DataType.from_word(word))
        except KeyError:
            refused[name] = word
    return types, refused


@dataclass(frozen=True, slots=True)
class InputRecipe:
    """An input recipe that the controller has accepted."""

    key: str
    id: int
    recipe: Recipe


@dataclass(slots=True)
class _Group:
    key: str
    wanted: tuple[str, ...]
    held: InputRecipe | None = None
    refused: dict[str, str] = field(default_factory=dict)
    asking: tuple[str, ...] = ()

    def retriable(self) -> bool:
        return any(word in _RETRIED for word in self.refused.values())

    def candidates(self) -> tuple[str, ...]:
        return tuple(name for name in self.wanted if self.refused.get(name, IN_USE) in _RETRIED)

    def names_held(self) -> tuple[str, ...]:
        return self.held.recipe.names if self.held is not None else ()


class Claims:
    """The claims of one connection.

    With `list_limit` no list of names is longer, in bytes; groups that are go into several recipes, the later ones
    under the keys "registers 2" and so on.
    """

    def __init__(
        self, fields: Sequence[str], watchdog: str | None = None, list_limit: int | None = None
    ) -> None:
        members: dict[str, list[str]] = {}
        for name in dict.fromkeys((*fields, *((watchdog,) if watchdog else ()))):
            members.setdefault(WATCHDOG_KEY if name == watchdog else recipe_key(name), []).append(name)
        self._groups = [
            _Group(key if part == 1 else f"{key} {part}", names)
            for key, whole in members.items()
            for part, names in enumerate(_parts(whole, list_limit), 1)
        ]
        self._queue: deque[_Group] = deque()
        self._used = 0
        self._changed = False
        self._exhausted = False
        self._enqueue(self._groups)

    @property
    def recipes(self) -> Mapping[str, InputRecipe]:
        """The newest accepted recipe of each group that has one."""
        return MappingProxyType({group.key: group.held for group in self._groups if group.held is not None})

    @property
    def refused(self) -> Mapping[str, str]:
        """Fields that are not claimed, with the controller's word for each."""
        return MappingProxyType(
            {name: word for group in self._groups for name, word in group.refused.items()}
        )

    @property
    def retriable(self) -> bool:
        """Whether asking again may help for some field."""
        return any(group.retriable() for group in self._groups)

    @property
    def exhausted(self) -> bool:
        """Whether a request was wanted after all recipe ids of the connection had been used."""
        return self._exhausted

    @property
    def busy(self) -> bool:
        """Whether an answer is awaited or more is to be asked."""
        return bool(self._queue)

    def retry(self) -> None:
        """Ask again for the fields that were in use; no effect while asking."""
        if not self._queue:
            self._enqueue([group for group in self._groups if group.retriable()])

    def request(self) -> SetupInputs | None:
        """What to send next; None when everything has been asked. Call again after `answer` only."""
        if not self._queue:
            return None
        if self._used >= _LAST_ID:
            self._exhausted = True
            self._queue.clear()
            return None
        return SetupInputs(self._queue[0].asking)

    def answer(self, reply: InputsSetup) -> None:
        """Take the answer to the last request."""
        if not self._queue:
            msg = "the controller answered an input setup that was not asked for"
            raise HandshakeError(msg)
        group = self._queue[0]
        types, refused = sort_types(group.asking, reply.types)
        if reply.recipe and not refused:
            self._hold(group, InputRecipe(group.key, reply.recipe, Recipe(group.asking, types)))
            return
        if not refused:
            refused = dict.fromkeys(
                (name for name in group.asking if name not in group.names_held()), REFUSED
            )
        group.refused.update(refused)
        group.asking = tuple(name for name in group.asking if name not in refused)
        if not group.asking or group.asking == group.names_held():
            self._queue.popleft()

    def take_change(self) -> bool:
        """Whether recipes have changed since the last call."""
        changed, self._changed = self._changed, False
        return changed

    def _enqueue(self, groups: Sequence[_Group]) -> None:
        for group in groups:
            group.asking = group.candidates()
            if group.asking:
                self._queue.append(group)

    def _hold(self, group: _Group, accepted: InputRecipe) -> None:
        group.held = accepted
        for name in accepted.recipe.names:
            group.refused.pop(name, None)
        self._used += 1
        self._changed = True
        self._queue.popleft()

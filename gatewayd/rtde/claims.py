"""Claiming controller inputs: which fields share a recipe, and what to ask for when some are refused.

Pure: requests out, answers in. A recipe with a refused field is refused whole, so the refused ones are left out and
the rest is asked for again; fields in use elsewhere are asked for again on `retry`, together with those already held,
so that a group always ends up in one recipe. A client may claim a field in several recipes; ids count 1 to 255.

A register whose content could not be read is moved to a recipe of its own by `separate`: no package that writes
another register carries it. `join` brings it back once its content is known.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from itertools import count
from types import MappingProxyType

from gatewayd.report.format import counted
from gatewayd.rtde.catalogue import is_long
from gatewayd.rtde.companions import COMPANIONS
from gatewayd.rtde.messages import ERROR_WORDS, IN_USE, InputsSetup, SetupInputs
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.types import DataType

REGISTERS_KEY = "registers"
"""Key of the recipe that holds every general purpose register."""
WATCHDOG_KEY = "watchdog"
"""Key of the watchdog field's own recipe: whatever else is written must not feed it."""
REFUSED = "REFUSED"
"""Our word for fields whose recipe the controller refused without saying why."""
UNASKED = "UNASKED"
"""Our word for fields that are claimed on request, and were not asked for yet."""

MAX_RECIPES = 255
"""Input recipes of a connection; ids count from 1."""

_IDS_FOR_RETRIES = 64
"""Recipe ids that joins leave over for inputs that become free later."""
_RETRIED = frozenset({IN_USE, REFUSED, UNASKED})
_FAMILIES = tuple({needs.mask.removesuffix("_mask"): None for needs in COMPANIONS.values()})


class ClaimStanding(Enum):
    """How claims on request stand. The first field that the controller has decides: who holds it holds the robot.

    Every client with the same wishes asks for it first, so of several that ask at one time exactly one gets it.
    """

    UNASKED = "unasked"
    ASKED = "asked"
    """An answer is due."""
    HELD = "held"
    """The field that decides is ours; others may be in use elsewhere and are asked for again."""
    PARTIAL = "partial"
    """Others are ours, and the one that decides is not."""
    REFUSED = "refused"
    """Nothing is ours."""


class HandshakeError(Exception):
    """An answer that does not belong to what was asked, or a refusal that leaves nothing to go on with."""


def recipe_key(name: str) -> str:
    """The recipe an input field belongs to: values that must reach the robot together share one.

    The registers make one recipe. A mask and its values make one for each family, because sending the mask acts.
    """
    if name.startswith("input_"):
        return REGISTERS_KEY
    return next((family for family in _FAMILIES if name.startswith(family)), name)


def sort_types(names: Sequence[str], words: Sequence[str]) -> tuple[list[DataType], dict[str, str]]:
    """The types of an answer to a setup request, and the words of the fields that are not available.

    A type word that we do not know counts as not available. HandshakeError if the numbers differ.
    """
    if len(words) != len(names):
        msg = f"the controller answered {counted(len(words), 'type')} for {counted(len(names), 'field')}"
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


@dataclass(frozen=True, slots=True, eq=False)
class InputRecipe:
    """An input recipe that the controller has accepted. It stays valid as long as its connection; equal to itself."""

    key: str
    id: int
    recipe: Recipe


@dataclass(slots=True, eq=False)
class _Group:
    key: str
    wanted: tuple[str, ...]
    held: InputRecipe | None = None
    refused: dict[str, str] = field(default_factory=dict)
    asking: tuple[str, ...] = ()
    named: bool = False
    """Made as it was asked for: never split, none of its fields in a recipe of its own."""

    def retriable(self) -> bool:
        return any(word in _RETRIED for word in self.refused.values())

    def candidates(self) -> tuple[str, ...]:
        return tuple(name for name in self.wanted if self.refused.get(name, IN_USE) in _RETRIED)

    def names_held(self) -> tuple[str, ...]:
        return self.held.recipe.names if self.held is not None else ()

    def is_of_registers(self) -> bool:
        return not self.named and self.key.split(" ")[0] == REGISTERS_KEY

    def part(self, number: int, names: Sequence[str]) -> _Group:
        """A group for some of the names; nothing is held by it."""
        key = self.key.split(" ")[0]
        refused = {name: self.refused[name] for name in names if name in self.refused}
        return _Group(key if number == 1 else f"{key} {number}", tuple(names), None, refused)


class Claims:
    """The claims of one connection.

    Where lists are limited none is longer than `OLD_LIST_LIMIT`; groups that are go into several recipes, the later
    ones under the keys "registers 2" and so on. Those of `recipes` stay as they are, under their own keys.
    """

    def __init__(
        self,
        fields: Sequence[str],
        watchdog: str | None = None,
        *,
        limited: bool = False,
        recipes: Mapping[str, tuple[str, ...]] = MappingProxyType({}),
        on_request: bool = False,
    ) -> None:
        """`on_request`: nothing is asked for before `retry`, nor again by itself before the claim is decided."""
        members: dict[str, list[str]] = {}
        for name in dict.fromkeys((*fields, *((watchdog,) if watchdog else ()))):
            members.setdefault(WATCHDOG_KEY if name == watchdog else recipe_key(name), []).append(name)
        self._order = {name: place for place, name in enumerate(members.get(REGISTERS_KEY, ()))}
        self._groups = [_Group(key, tuple(names)) for key, names in members.items()]
        self._groups += [_Group(key, names, named=True) for key, names in recipes.items()]
        self._queue: deque[_Group] = deque()
        self._joining: dict[str, None] = {}
        self._accepted: dict[int, InputRecipe] = {}
        self._used = 0
        self._asked = False
        self._changed = False
        self.exhausted = False
        """Whether a request was wanted after all recipe ids of the connection had been used."""
        self._limited = False
        self._on_request = on_request
        self._requested = not on_request
        """Whether groups may be asked for."""
        self._wanted = tuple(name for group in self._groups for name in group.wanted)
        for group in self._groups if on_request else ():
            group.refused = dict.fromkeys(group.wanted, UNASKED)
        self._enqueue(self._groups)
        if limited:
            self.limit()

    @property
    def recipes(self) -> Mapping[str, InputRecipe]:
        """The newest accepted recipe of each group that has one."""
        return MappingProxyType({group.key: group.held for group in self._groups if group.held is not None})

    @property
    def types(self) -> Mapping[str, DataType]:
        """Every field that is claimed, with its type."""
        held = (accepted.recipe for accepted in self.recipes.values())
        return {name: kind for recipe in held for name, kind in recipe.kinds.items()}

    @property
    def refused(self) -> Mapping[str, str]:
        """Fields that are not claimed, with the controller's word for each."""
        return MappingProxyType(
            {name: word for group in self._groups for name, word in group.refused.items()}
        )

    @property
    def retriable(self) -> bool:
        """Whether asking again by itself may help for some field."""
        if self._on_request and self.standing is not ClaimStanding.HELD:
            return False
        return any(group.retriable() for group in self._groups)

    @property
    def standing(self) -> ClaimStanding:
        """How the claims stand as a whole."""
        if not self._requested:
            return ClaimStanding.UNASKED
        if self._queue:
            return ClaimStanding.ASKED
        refused, held = self.refused, self.types
        decides = next((name for name in self._wanted if refused.get(name, IN_USE) in _RETRIED), None)
        if decides in held:
            return ClaimStanding.HELD
        return ClaimStanding.PARTIAL if held else ClaimStanding.REFUSED

    @property
    def busy(self) -> bool:
        """Whether an answer is awaited or more is to be asked."""
        return bool(self._queue)

    @property
    def asked(self) -> tuple[str, ...]:
        """The list whose answer is awaited."""
        return self._queue[0].asking if self._asked and self._queue else ()

    def accepted(self, recipe: InputRecipe) -> bool:
        """Whether the recipe is one of this connection's, be it an older one of its group."""
        return self._accepted.get(recipe.id) is recipe

    def limit(self) -> None:
        """Ask by lists that old controllers take from now on; only while no answer is awaited."""
        self._limited = True
        for group in tuple(self._groups):
            if group.held is None and not group.named and is_long(group.wanted):
                self._split(group)

    def change(self, recipes: Mapping[str, tuple[str, ...]]) -> None:
        """Have these recipes in place of those named before; only while no answer is awaited.

        What stays as it was keeps its id. Fields that are no longer wanted stay claimed until the connection ends.
        """
        former = {group.key: group for group in self._groups if group.named}
        self._groups = [group for group in self._groups if not group.named]
        for key, names in recipes.items():
            known = former.get(key)
            stays = known is not None and known.wanted == names
            self._groups.append(known if known is not None and stays else _Group(key, names, named=True))
        self._changed = True
        self._enqueue([group for group in self._groups if group.named and group.held is None])

    def retry(self) -> None:
        """Ask again for the fields that were in use, or were not asked for yet; no effect while asking."""
        self._requested = True
        if not self._queue:
            self._enqueue([group for group in self._groups if group.retriable()])

    def separate(self, fields: Iterable[str]) -> None:
        """Give each of these registers a recipe of its own; only while no answer is awaited."""
        apart = frozenset(fields)
        for group in tuple(self._groups):
            leaving = [name for name in group.wanted if name in apart] if group.is_of_registers() else []
            if not leaving:
                continue
            staying = tuple(name for name in group.wanted if name not in apart)
            alone = [_Group(name, (name,)) for name in leaving]
            for own in alone:
                own.refused = {name: group.refused.pop(name) for name in own.wanted if name in group.refused}
            settled = group not in self._queue and not set(staying) & set(group.names_held())
            group.wanted, group.held = staying, None
            self._replace(group, [*([group] if staying else ()), *alone])
            if settled and staying and group in self._queue:
                self._queue.remove(group)

    def join(self, fields: Iterable[str]) -> None:
        """Have registers that were separated share a recipe with the others again, at the next request.

        No effect for others, nor once few recipe ids are left.
        """
        if self._used < MAX_RECIPES - _IDS_FOR_RETRIES:
            alone = {group.key for group in self._groups if group.held is not None}
            self._joining |= {name: None for name in fields if name in alone and name in self._order}

    def request(self) -> SetupInputs | None:
        """What to send next; None while an answer is awaited or when everything has been asked."""
        if self._asked:
            return None
        if not self._queue and self._joining:
            self._take_in()
        if not self._queue:
            return None
        if self._used >= MAX_RECIPES:
            self.exhausted = True
            self._queue.clear()
            return None
        self._asked = True
        return SetupInputs(self._queue[0].asking)

    def answer(self, reply: InputsSetup) -> None:
        """Take the answer to the last request. One with another number of types than was asked for is a refusal."""
        if not self._asked:
            msg = "the controller answered an input setup that was not asked for"
            raise HandshakeError(msg)
        group = self._queue[0]
        if _refused_for_length(group.asking, reply) and not group.named:
            self._asked = False
            self._split(group)
            return
        self._asked = False
        is_whole = len(reply.types) == len(group.asking)
        types, refused = sort_types(group.asking, reply.types) if is_whole else ([], {})
        if reply.recipe and is_whole and not refused:
            self._hold(group, InputRecipe(group.key, reply.recipe, Recipe(group.asking, types)))
            return
        self._used += not is_whole  # the controller may have given it an id
        if not refused:
            refused = dict.fromkeys(
                (name for name in group.asking if name not in group.names_held()), REFUSED
            )
        self._refuse(group, refused)
        if not group.asking or group.asking == group.names_held():
            self._queue.popleft()

    def take_change(self) -> bool:
        """Whether recipes have changed since the last call."""
        changed, self._changed = self._changed, False
        return changed

    def _enqueue(self, groups: Iterable[_Group]) -> None:
        if not self._requested:
            return
        for group in groups:
            group.asking = group.candidates()
            if group.asking and group not in self._queue:
                self._queue.append(group)

    def _replace(self, group: _Group, successors: Sequence[_Group]) -> None:
        """Put other groups in place of one, and ask for what they hold."""
        place = self._groups.index(group)
        self._groups[place : place + 1] = successors
        if group in self._queue:
            self._queue.remove(group)
        self._changed = True
        self._enqueue(successors)

    def _split(self, group: _Group) -> None:
        self._limited = True
        parts = _parts(group.wanted)
        self._replace(group, [group.part(number, names) for number, names in enumerate(parts, 1)])

    def _take_in(self) -> None:
        """Have the groups of registers ask for the fields that are to join."""
        alone = {group.key for group in self._groups}
        for name in (name for name in self._joining if name in alone):
            groups = [group for group in self._groups if group.is_of_registers()]
            roomy = [group for group in groups if not (self._limited and is_long((*group.wanted, name)))]
            group = roomy[-1] if roomy else self._new_group()
            group.wanted = tuple(sorted((*group.wanted, name), key=self._order.__getitem__))
            self._enqueue((group,))
        self._joining.clear()

    def _new_group(self) -> _Group:
        """Another group of registers, without any."""
        first, keys = _Group(REGISTERS_KEY, ()), {group.key for group in self._groups}
        group = next(part for part in (first.part(n, ()) for n in count(1)) if part.key not in keys)
        self._groups.append(group)
        return group

    def _hold(self, group: _Group, accepted: InputRecipe) -> None:
        group.held = accepted
        self._accepted[accepted.id] = accepted
        for name in accepted.recipe.names:
            group.refused.pop(name, None)
        if group.is_of_registers():
            self._groups = [other for other in self._groups if other.key not in accepted.recipe.names]
        self._used += 1
        self._changed = True
        self._queue.popleft()

    def _refuse(self, group: _Group, refused: Mapping[str, str]) -> None:
        """Note refusals; a register that was to join stays in the recipe of its own that it has."""
        alone = {
            other.key
            for other in self._groups
            if other is not group and other.held is not None and not other.named
        }
        group.wanted = tuple(name for name in group.wanted if not (name in refused and name in alone))
        group.refused.update({name: word for name, word in refused.items() if name not in alone})
        group.asking = tuple(name for name in group.asking if name not in refused)


def _refused_for_length(names: Sequence[str], reply: InputsSetup) -> bool:
    return reply.recipe == 0 and ERROR_WORDS.isdisjoint(reply.types) and len(names) > 1 and is_long(names)


def _parts(names: Sequence[str]) -> list[list[str]]:
    """Split so that no part is too long a list."""
    parts: list[list[str]] = [[]]
    for name in names:
        if parts[-1] and is_long((*parts[-1], name)):
            parts.append([])
        parts[-1].append(name)
    return parts

"""What a new mapping changes of a running one, and what of it must not happen unasked.

Parts are compared by name and shown as they stand in the mapping file; a reload takes over what has the same name and
the same place in the robot (`gatewayd.core.succession`).
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from enum import Enum
from itertools import groupby

from gatewayd.core.objection import Objection, ObjectionKind
from gatewayd.links.contract import Names
from gatewayd.mapping.plan import Plan
from gatewayd.report import facts
from gatewayd.report.facts import Facts
from gatewayd.report.format import counted, plural
from gatewayd.report.printable import json_document, printable
from gatewayd.report.weakening import weakened
from gatewayd.report.wording import family

MAX_GONE = 0.3
"""Part of the variables that may disappear unasked: more looks like the wrong file."""


class ChangeKind(Enum):
    """What became of a part; the value is the mark in front of its line."""

    ADDED = "+"
    REMOVED = "-"
    CHANGED = "~"


@dataclass(frozen=True, slots=True)
class Detail:
    """One fact that differs; empty where one side does not have it."""

    what: str
    old: str
    new: str


@dataclass(frozen=True, slots=True)
class Difference:
    """One part that differs. Of an added or removed one every fact is a detail."""

    kind: ChangeKind
    name: str
    details: tuple[Detail, ...]

    def detail(self, what: str) -> Detail | None:
        """The detail about one fact; None if it is the same."""
        return next((detail for detail in self.details if detail.what == what), None)


@dataclass(frozen=True, slots=True)
class Renumbered:
    """A variable whose number in the status block is another one."""

    name: str
    old: int
    new: int


@dataclass(frozen=True, slots=True)
class Changes:
    """All differences between two plans of one cell."""

    old: Plan
    new: Plan
    links: tuple[Difference, ...]
    writers: tuple[Difference, ...]
    groups: tuple[Difference, ...]
    variables: tuple[Difference, ...]
    renumbered: tuple[Renumbered, ...]

    def __bool__(self) -> bool:
        """Whether there is any difference, be it a comment."""
        old, new = self.old.cell, self.new.cell
        return bool(self.links or self.writers or self.groups or self.variables or self.renumbered) or (
            (old.name, old.fingerprint) != (new.name, new.fingerprint)
        )

    @property
    def _named(self) -> bool:
        return self.old.cell.name != self.new.cell.name

    def of(self, kind: ChangeKind) -> tuple[str, ...]:
        """Names of the variables that were added, removed or changed."""
        return tuple(difference.name for difference in self.variables if difference.kind is kind)

    @property
    def summary(self) -> str:
        """`press-3: 1 variable added, 2 changed, settings of robot changed`."""
        parts: list[str] = []
        for kind in ChangeKind:
            count = len(self.of(kind))
            if count:
                parts.append(f"{count if parts else counted(count, 'variable')} {kind.name.lower()}")
        for noun, differences in (("writer", self.writers), ("group", self.groups)):
            if differences:
                names = ", ".join(difference.name for difference in differences)
                parts.append(f"{noun if len(differences) == 1 else plural(noun)} {names} changed")
        if self.links:
            parts.append(f"settings of {', '.join(difference.name for difference in self.links)} changed")
        if self.renumbered and not parts:
            parts.append("variables in another order")
        if not parts and self:
            parts.append("renamed" if self._named else "other settings")
        name = f"{self.old.cell.name} -> {self.new.cell.name}" if self._named else self.new.cell.name
        return f"{name}: {', '.join(parts) or 'no difference'}"


def compare(old: Plan, new: Plan) -> Changes:
    """Everything that differs, in the order of the new file, what is gone last."""
    numbers = {variable.name: variable.number for variable in old.cell.variables}
    return Changes(
        old,
        new,
        tuple(_differences(facts.links(old), facts.links(new))),
        tuple(_differences(facts.writers(old), facts.writers(new))),
        tuple(_differences(facts.groups(old), facts.groups(new))),
        tuple(_differences(facts.variables(old), facts.variables(new))),
        tuple(
            Renumbered(variable.name, numbers[variable.name], variable.number)
            for variable in new.cell.variables
            if numbers.get(variable.name, variable.number) != variable.number
        ),
    )


def _differences(old: Mapping[str, Facts], new: Mapping[str, Facts]) -> Iterator[Difference]:
    for name, facts_now in new.items():
        former = old.get(name)
        details = tuple(_details(former or {}, facts_now))
        if former is None:
            yield Difference(ChangeKind.ADDED, name, details)
        elif details:
            yield Difference(ChangeKind.CHANGED, name, details)
    for name, former in old.items():
        if name not in new:
            yield Difference(ChangeKind.REMOVED, name, tuple(_details(former, {})))


def _details(old: Facts, new: Facts) -> Iterator[Detail]:
    for what in dict.fromkeys((*old, *new)):
        before, after = old.get(what, ""), new.get(what, "")
        if before != after:
            yield Detail(what, before, after)


# -- what must not happen unasked -------------------------------------------------------------------


def objections(
    changes: Changes, kept: Collection[str], *, numbers_used: bool = False
) -> tuple[Objection, ...]:
    """Why the new mapping must not replace the running one unasked, as far as the two of them tell it.

    `kept`: variables that are owned at this moment and stay so; what owners would lose, the running cell knows.
    `numbers_used`: locks were requested by number. A machine may be moving by what is owned, a direction that turns
    round makes a reader a writer, a promise that is weakened is one that others rely on, and a file that lost many
    variables is most often the wrong one.
    """
    found = [
        *(Objection(ObjectionKind.OWNED, text) for text in _touches_owned(changes, kept)),
        *(Objection(ObjectionKind.DIRECTION, text) for text in _turns_round(changes)),
        *(Objection(ObjectionKind.WEAKENING, text) for text in weakened(changes.old.cell, changes.new.cell)),
        *(Objection(ObjectionKind.NUMBERS, text) for text in _means_others(changes) if numbers_used),
    ]
    gone, before = len(changes.of(ChangeKind.REMOVED)), len(changes.old.cell.variables)
    if gone > MAX_GONE * before:
        found.append(
            Objection(
                ObjectionKind.GONE,
                f"{gone} of {counted(before, 'variable')} would be gone: is it the right file?",
            )
        )
    return tuple(found)


def _touches_owned(changes: Changes, kept: Collection[str]) -> Iterator[str]:
    for difference in changes.variables:
        if difference.name in kept and not all(map(_is_harmless, difference.details)):
            yield f"`{difference.name}` is owned now and would change: {_changed(difference.details)}"
    for difference in changes.groups:
        for name in sorted(_members(changes.old, difference.name).intersection(kept))[:1]:
            yield (
                f"`{name}` of the group `{difference.name}` is owned now, and the group would change: "
                f"{_changed(difference.details)}"
            )


def _is_harmless(detail: Detail) -> bool:
    """Whether the owner cannot notice: words for people, or others who may own it too once it is free."""
    if detail.what == "owner" and " > " not in detail.new:
        return set(detail.old.split(", ")) <= set(detail.new.split(", "))
    return detail.what in facts.FOR_PEOPLE


def _turns_round(changes: Changes) -> Iterator[str]:
    for difference in changes.variables:
        turned = difference.detail("direction") if difference.kind is ChangeKind.CHANGED else None
        if turned is not None:
            yield f"`{difference.name}` would turn from {turned.old} to {turned.new}"


def _means_others(changes: Changes) -> Iterator[str]:
    """Numbers that stand for another variable; one that stands for none is refused, and harms nobody."""
    pairs = zip(changes.old.cell.variables, changes.new.cell.variables, strict=False)
    moved = [(old, new) for old, new in pairs if old.name != new.name]
    if moved:
        (old, new), count = moved[0], len(moved)
        more = f" (and {count - 1} more)" if count > 1 else ""
        yield f"a request for lock {old.number} would mean `{new.name}` instead of `{old.name}`{more}"


def _members(plan: Plan, group: str) -> set[str]:
    locks = (lock for lock in plan.cell.locks if lock.name == group)
    return {plan.cell.variables[index].name for lock in locks for index in lock.members}


# -- for people and programs -------------------------------------------------------------------


def as_text(changes: Changes) -> str:
    """A summary line, then one line for each part that differs; elements of a range that differ alike share one."""
    lines = [changes.summary]
    if changes.old.cell.fingerprint != changes.new.cell.fingerprint:
        lines[0] += f"; fingerprint {changes.old.cell.fingerprint:08X} -> {changes.new.cell.fingerprint:08X}"
    for noun, differences in (("", changes.links), ("writer ", changes.writers), ("group ", changes.groups)):
        lines += [_line(noun, difference) for difference in differences]
    lines += [_line("", difference) for difference in _folded(changes.variables)]
    if changes.renumbered:
        first, count = changes.renumbered[0], len(changes.renumbered)
        lines.append(
            f"note: the status block renumbers {counted(count, 'variable')}, from `{first.name}` "
            f"({first.old} -> {first.new}) on; variables added at the end of the file renumber none"
        )
    return "".join(f"{printable(line, None)}\n" for line in lines)


def as_json(changes: Changes) -> str:
    """One JSON document: `version`, `cell`, `old` and `new` (source, fingerprint), the four lists, `renumbered`.

    Keys are only ever added within a version.
    """
    document = {
        "version": 1,
        "cell": changes.new.cell.name,
        "summary": changes.summary,
        **{
            side: {
                "source": plan.source,
                "cell": plan.cell.name,
                "fingerprint": f"{plan.cell.fingerprint:08X}",
            }
            for side, plan in (("old", changes.old), ("new", changes.new))
        },
        **{
            name: list(map(_as_object, getattr(changes, name)))
            for name in ("links", "writers", "groups", "variables")
        },
        "renumbered": list(map(asdict, changes.renumbered)),
    }
    return json_document(document)


def _as_object(difference: Difference) -> dict[str, object]:
    return asdict(difference) | {"kind": difference.kind.name.lower()}


def _line(noun: str, difference: Difference) -> str:
    head = f"{difference.kind.value} {noun}{difference.name}: "
    if difference.kind is ChangeKind.CHANGED:
        return head + _changed(difference.details)
    return head + "; ".join(f"{detail.what} {detail.old or detail.new}" for detail in difference.details)


def _changed(details: Iterable[Detail]) -> str:
    return "; ".join(map(_change, details))


def _change(detail: Detail) -> str:
    if isinstance(detail.old, Names) or isinstance(detail.new, Names):
        old, new = detail.old.split(), detail.new.split()
        marked = [f"+{name}" for name in new if name not in old] + [
            f"-{name}" for name in old if name not in new
        ]
        return f"{detail.what} {' '.join(marked)}"
    return f"{detail.what} {detail.old or 'none'} -> {detail.new or 'none'}"


_ELEMENT = re.compile(r"(.*)\[(\d+)\]")


def _folded(differences: Iterable[Difference]) -> Iterator[Difference]:
    """Elements that follow each other and differ in the same facts become one difference, `recipe[0..23]`."""
    for _, run in groupby(enumerate(differences), _run):
        elements = [difference for _, difference in run]
        yield elements[0] if len(elements) == 1 else _merged(elements[0], elements[-1])


def _run(numbered: tuple[int, Difference]) -> object:
    """What the elements of one run, and nothing else, have in common."""
    number, difference = numbered
    element = _ELEMENT.fullmatch(difference.name)
    if element is None:
        return number
    facts = [detail.what for detail in difference.details]
    return element[1], int(element[2]) - number, difference.kind, facts


def _merged(first: Difference, last: Difference) -> Difference:
    details = tuple(
        Detail(detail.what, _span(detail.old, other.old), _span(detail.new, other.new))
        for detail, other in zip(first.details, last.details, strict=True)
    )
    return Difference(first.kind, family(first.name, last.name), details)


def _span(first: str, last: str) -> str:
    return first if first == last else f"{first} .. {last}"

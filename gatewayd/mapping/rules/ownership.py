"""Rules GW5xx: who may write, and who holds what for how long."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from gatewayd.core.definition import Direction
from gatewayd.links.registry import definer, languages
from gatewayd.mapping.diagnostics import Diagnostic, Position, Related, Rule, Severity
from gatewayd.mapping.document import Document, Part
from gatewayd.mapping.expanded import ExpandedCell, ExpandedLock
from gatewayd.mapping.model import ANY, Group, VariableSpec
from gatewayd.mapping.rules.registry import cell_rule
from gatewayd.mapping.rules.writers import is_supervised
from gatewayd.report.format import counted
from gatewayd.report.wording import alternatives, did_you_mean, seconds

_MIN_LEASE = 0.1
_RESERVED = (ANY, "free", "gateway", "operator", "robot", "undeclared")
_POLICY = ("owner", "lease", "takeover")


@cell_rule("GW501")
def no_writer(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Input variables in a file without writers."""
    if cell.document.declared("writers") or cell.document.writers:
        return
    inputs = [variable for variable in cell.variables if variable.direction is Direction.INPUT]
    if inputs:
        more = f" and {counted(len(inputs) - 1, 'more input')}" if len(inputs) > 1 else ""
        message = f"nobody can write `{inputs[0].name}`{more}: the file declares no writers"
        having = [language for language in languages() if language.writer_keys is not None]
        here = [language for language in having if language.key in cell.document.sections]
        example = (here or having)[0]
        known_by = f"{example.writer_example}, {example.supervision_example or 'timeout: 1s'}"
        hint = f"add `writers: {{plc: {{{known_by}}}}}`"
        yield rule.at(inputs[0].position, message, hint=hint)


@cell_rule("GW502")
def unknown_writer(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """An owner that is not among the writers."""
    known = cell.document.declared("writers")
    if not known and definer().key not in cell.document.sections:
        return
    for name, position, role in _named_writers(cell.document):
        if name != ANY and name not in known:
            hint = did_you_mean(name, known, f"add `{name}` to the section `writers`")
            yield rule.at(position, f"`{name}`, {role}, is not among the writers", hint=hint)
    for language in languages():
        for named in language.names_writers(cell.document):
            if named.name == ANY and named.no_any and named.whole is not None:
                hint = "name the writers, or leave `requires` out"
                yield rule.at(named.whole, named.no_any, hint=hint)
                break


@cell_rule("GW503")
def writer_twice(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A writer that is named twice in one list."""
    for part in _owned(cell.document):
        owners = part.spec.owner or ()
        for index, name in enumerate(owners):
            first = owners.index(name)
            if first < index:
                related = (Related(part.at("owner", first), f"`{name}` first named here"),)
                message = f"`{name}` is named twice among the owners of `{part.name}`"
                hint = "remove one of the two"
                yield rule.at(part.at("owner", index), message, hint=hint, related=related)


@cell_rule("GW506", Severity.WARNING)
def group_of_one(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A group with a single variable."""
    if not _is_whole(cell):
        return
    for lock in cell.locks:
        if lock.group is not None and len(lock.members) == 1:
            member = cell.variables[lock.members[0]]
            message = f"the group `{lock.name}` has a single member, `{member.name}`"
            related = (Related(member.at("group"), "the member is here"),)
            hint = "name the group at another variable too, or move `owner` and `lease` to the variable"
            yield rule.at(lock.group.key, message, hint=hint, related=related)


@cell_rule("GW507")
def member_with_own_owner(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A member of a group with an owner or lease of its own."""
    for part in cell.document.variables.values():
        if part.spec.group is None:
            continue
        for key in _POLICY:
            if key in part.spec.model_fields_set:
                group = cell.document.groups.get(part.spec.group)
                related = (Related(group.key, f"the group `{group.name}`"),) if group is not None else ()
                message = (
                    f"`{part.name}` is owned with the group `{part.spec.group}` and has `{key}` of its own"
                )
                hint = f"remove `{key}` here, or remove `group`"
                yield rule.at(part.key_at(key), message, hint=hint, related=related)


@cell_rule("GW508", Severity.WARNING)
def short_lease(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A lease that ends before its owner can count as lost."""
    for lock in _distinct(cell.locks):
        if lock.lease is None:
            continue
        place = _lease_place(cell, lock)
        if lock.lease < _MIN_LEASE:
            message = (
                f"a lease of {seconds(lock.lease)} for `{lock.name}` ends with every hiccup of the network"
            )
            yield rule.at(place, message, hint=f"use at least {seconds(_MIN_LEASE)}, better 1s")
            continue
        for name in lock.owners:
            writer = cell.document.writers[name]
            if writer.spec.timeout is not None and writer.spec.timeout > lock.lease:
                message = (
                    f"the lease of `{lock.name}` ({seconds(lock.lease)}) is shorter than the timeout of "
                    f"its owner `{name}` ({seconds(writer.spec.timeout)})"
                )
                related = (Related(writer.at("timeout"), f"timeout of `{name}`"),)
                hint = f"use a lease of at least {seconds(writer.spec.timeout)}, or a shorter timeout"
                yield rule.at(place, message, hint=hint, related=related)
                break


@cell_rule("GW509", Severity.WARNING)
def idle_writer(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A writer that may write nothing."""
    if not _is_whole(cell):
        return
    named = {name for name, _, _ in _named_writers(cell.document)}
    if named - {ANY} - cell.document.declared("writers") or any(
        len(part.spec.owner or ()) > 1 and ANY in (part.spec.owner or ()) for part in _owned(cell.document)
    ):
        # A wrong name has its own finding, and may be what this writer was meant by.
        return
    used = named | {name for lock in cell.locks for name in lock.owners}
    for writer in cell.document.writers.values():
        if writer.name not in used:
            message = f"the writer `{writer.name}` owns no variable"
            yield rule.at(writer.key, message, hint="name it as `owner` of a variable, or remove it")


@cell_rule("GW510")
def unknown_group(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A group that is not declared."""
    known = cell.document.declared("groups")
    for part in cell.document.variables.values():
        name = part.spec.group
        if name is not None and name not in known:
            hint = did_you_mean(name, known, f"add `{name}` to the section `groups`")
            yield rule.at(part.at("group"), f"the group `{name}` of `{part.name}` is not declared", hint=hint)


@cell_rule("GW511", Severity.WARNING)
def unused_group(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A group without a member."""
    if not _is_whole(cell):
        return
    used = {part.spec.group for part in cell.document.variables.values()}
    for group in cell.document.groups.values():
        if group.name not in used:
            message = f"no variable belongs to the group `{group.name}`"
            yield rule.at(group.key, message, hint=f"write `group: {group.name}` at its variables")


@cell_rule("GW512", Severity.WARNING)
def takeover_of_nobody(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Takeover where there is no order of owners."""
    for part in _owned(cell.document):
        owners = part.spec.owner or (ANY,)
        if part.spec.takeover and len(owners) == 1:
            message = f"`{part.name}` has takeover, but " + (
                f"`{ANY}` has no order of owners" if owners[0] == ANY else f"`{owners[0]}` is its only owner"
            )
            hint = "name the owners by priority: owner: [plc, hmi]"
            yield rule.at(part.key_at("takeover"), message, hint=hint)


@cell_rule("GW513")
def owner_of_output(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """An owner of a variable that nobody writes."""
    seen: set[str] = set()
    for variable in cell.variables:
        if variable.direction is Direction.INPUT or variable.part.name in seen:
            continue
        seen.add(variable.part.name)
        for key in (*_POLICY, "group"):
            if key in variable.spec.model_fields_set:
                message = f"`{variable.part.name}` comes from the robot ({variable.target}) and has `{key}`"
                hint = f"remove `{key}`, or map an input such as {variable.counterpart}"
                yield rule.at(variable.part.key_at(key), message, hint=hint)


@cell_rule("GW514", Severity.WARNING)
def endless_lock(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A shared variable that a silent writer can keep for ever."""
    for lock, silent in endless_locks(cell):
        message = f"`{lock.name}` has no lease, and its owner `{silent}` no timeout"
        related = (Related(cell.document.writers[silent].key, f"`{silent}` is here"),)
        hint = f"add `lease: 5s` here, or `timeout: 1s` to `{silent}`"
        yield rule.at(_lease_place(cell, lock), message, hint=hint, related=related)


def endless_locks(cell: ExpandedCell) -> Iterator[tuple[ExpandedLock, str]]:
    """Shared locks without a lease, one of each line, and the first owner that could keep them unnoticed."""
    for lock in _distinct(cell.locks):
        silent = [name for name in lock.owners if not is_supervised(cell.document.writers[name].spec)]
        if len(lock.owners) > 1 and lock.lease is None and silent:
            yield lock, silent[0]


@cell_rule("GW516")
def any_among_owners(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """The word any in a list of owners."""
    for part in _owned(cell.document):
        owners = part.spec.owner or ()
        if len(owners) > 1 and ANY in owners:
            message = f"`{ANY}` stands among the named owners of `{part.name}`"
            hint = "write `owner: any`, or name all writers by priority"
            yield rule.at(part.at("owner", owners.index(ANY)), message, hint=hint)


@cell_rule("GW517")
def reserved_writer_name(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A writer with a name that the gateway uses itself."""
    for writer in cell.document.writers.values():
        if writer.name in _RESERVED:
            message = f"`{writer.name}` is a name that the gateway uses itself"
            yield rule.at(
                writer.key, message, hint="give the writer another name, such as what it is: plc, hmi, line"
            )


@cell_rule("GW523", Severity.WARNING)
def owner_left_out(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Several writers, and a variable that names none of them as its owner."""
    for lock in _distinct(cell.locks):
        part = lock.group if lock.group is not None else cell.variables[lock.members[0]].part
        if lock.is_any and part.spec.owner is None and len(lock.owners) > 1:
            writers = alternatives(lock.owners[:4])
            message = f"`{lock.name}` names no owner, so each of the writers may write it: {writers}"
            hint = f"write `owner: {lock.owners[0]}`, a list by priority, or `owner: {ANY}` if each may"
            yield rule.at(lock.position, message, hint=hint)


def _owned(document: Document) -> Iterator[Part[Group] | Part[VariableSpec]]:
    """Everything that can name owners."""
    yield from document.groups.values()
    yield from document.variables.values()


def _named_writers(document: Document) -> Iterator[tuple[str, Position, str]]:
    for part in _owned(document):
        for index, name in enumerate(part.spec.owner or ()):
            yield name, part.at("owner", index), f"the owner of `{part.name}`"
    for language in languages():
        for named in language.names_writers(document):
            yield named.name, named.position, named.role


def _is_whole(cell: ExpandedCell) -> bool:
    """Whether every variable could be read: else a line that is left out may be the one that uses a thing."""
    return len(cell.document.declared("variables")) == len(cell.document.variables)


def _distinct(locks: Iterable[ExpandedLock]) -> Iterator[ExpandedLock]:
    """One lock of each line: those of a family are alike."""
    seen: set[Position] = set()
    for lock in locks:
        if lock.position not in seen:
            seen.add(lock.position)
            yield lock


def _lease_place(cell: ExpandedCell, lock: ExpandedLock) -> Position:
    part = lock.group if lock.group is not None else cell.variables[lock.members[0]].part
    return part.at("lease") if "lease" in part.spec.model_fields_set else lock.position

"""Rules GW230 to GW235 and GW237 to GW239: the listener with TLS, its roles, and the writers known by them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from gatewayd.core.definition import Direction
from gatewayd.links.modbus_server.plan import RoleWriter
from gatewayd.links.modbus_server.roles import named_by, role_writers
from gatewayd.links.modbus_server.sections import Modbus, ModbusWriter
from gatewayd.links.modbus_server.tls_sections import ALL, RoleSpec
from gatewayd.mapping.diagnostics import Diagnostic, Position, Related, Rule, Severity
from gatewayd.mapping.document import Part
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.model import WriterSpec
from gatewayd.mapping.rules.registry import cell_rule, plant_rule
from gatewayd.report.wording import did_you_mean, names_and_more

_FILES = ("certificate", "key", "clients", "revoked")


@plant_rule("GW230")
def secured_and_not(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """One address with TLS and without."""
    first: dict[str, tuple[Part[Modbus], tuple[str, ...]]] = {}
    for cell in cells:
        modbus = cell.document.part(Modbus)
        for path, listen in modbus.spec.addresses.items() if modbus is not None else ():
            assert modbus is not None
            other, earlier = first.setdefault(str(listen), (modbus, path))
            if earlier != path:
                message = f"{listen} cannot be with TLS and without"
                related = (Related(other.at(*earlier), f"{listen} first used here"),)
                hint = "give the two different ports: 802 is that of Modbus with TLS"
                yield rule.at(modbus.at(*path), message, hint=hint, related=related)


@plant_rule("GW231")
def secured_otherwise(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """Cells on one listener with TLS that name different files."""
    first: dict[str, tuple[ExpandedCell, Part[Modbus]]] = {}
    for cell in cells:
        modbus = cell.document.part(Modbus)
        if modbus is None or modbus.spec.tls is None:
            continue
        listen = str(modbus.spec.tls.listen)
        other, earlier = first.setdefault(listen, (cell, modbus))
        for key in _FILES:
            here, there = getattr(modbus.spec.tls, key), getattr(earlier.spec.tls, key)
            if here != there:
                message = (
                    f"`{key}` of {listen} differs from that of the cell `{other.document.cell}`: it has one"
                )
                place = earlier.at("tls", key)
                related = (Related(place, f"`{key}` of `{other.document.cell}`"),)
                hint = "name the same files in both mappings, or listen on different addresses"
                yield rule.at(modbus.at("tls", key), message, hint=hint, related=related)


@cell_rule("GW232")
def role_without_rights(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A writer whose role may write nothing."""
    modbus = cell.document.part(Modbus)
    if modbus is None or modbus.spec.tls is None:
        return
    roles = modbus.spec.tls.roles
    for writer, role in _by_role(cell):
        if role not in roles:
            message = f"the writer `{writer.name}` has the role `{role}`, which may do nothing: it is not in `roles`"
            hint = f"add `{role}: {{read: all, write: all}}` to `modbus: tls: roles:`, with less where less is enough"
            yield rule.at(writer.at("role"), message, hint=did_you_mean(role, roles, hint))
        elif not roles[role].write:
            message = f"the writer `{writer.name}` has the role `{role}`, which may write nothing"
            related = (Related(modbus.key_at("tls", "roles", role), f"the rights of `{role}`"),)
            hint = "add `write:` to the role, with names of variables or groups, or all"
            yield rule.at(writer.at("role"), message, hint=hint, related=related)


@cell_rule("GW233")
def role_without_listener(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A writer with a role, and no listener with TLS."""
    # One that cannot be read has findings of its own, and to add it would be wrong advice.
    if "tls" in cell.document.declared("modbus"):
        return
    for writer, role in _by_role(cell):
        message = (
            f"the writer `{writer.name}` is known by the role `{role}`, but there is no listener with TLS"
        )
        hint = "add `modbus: tls:` with certificate, key, clients and roles, or name its address instead of a role"
        yield rule.at(writer.at("role"), message, hint=hint)


@cell_rule("GW234")
def unknown_name_in_role(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A role with a right to something that there is not."""
    known = [*cell.document.variables, *cell.document.groups]
    for part, path, spec in _roles(cell):
        for key, names in _granted(spec).items():
            for number, name in enumerate(names):
                if name != ALL and not named_by(name, cell) and name not in cell.document.groups:
                    message = f"`{name}` is neither a variable nor a group"
                    hint = did_you_mean(name, known, f"write a name from `variables` or `groups`, or {ALL}")
                    yield rule.at(part.at(*path, key, number), message, hint=hint)


@cell_rule("GW235", Severity.WARNING)
def right_to_write_output(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A role that may write what nobody can write."""
    for part, path, spec in _roles(cell):
        for number, name in enumerate(spec.write):
            found = named_by(name, cell) if name != ALL else []
            if found and all(variable.direction is Direction.OUTPUT for variable in found):
                message = f"`{name}` comes from the robot: a right to write it has no effect"
                hint = "name it under `read:`"
                yield rule.at(part.at(*path, "write", number), message, hint=hint)


@cell_rule("GW237")
def same_role(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Two writers with the same role and place."""
    first: dict[tuple[str, object], Part[WriterSpec]] = {}
    for index, writer in enumerate(cell.document.writers.values()):
        for known in role_writers(writer.spec.by(ModbusWriter), index):
            other = first.setdefault((known.role, known.network), writer)
            if other is not writer:
                message = f"`{writer.name}` and `{other.name}` cannot be told apart: both are {_as(known)}"
                related = (Related(other.at("role"), f"the role of `{other.name}`"),)
                hint = "give each its own role, or name the address of each beside it: modbus: 192.0.2.20"
                yield rule.at(writer.at("role"), message, hint=hint, related=related)
                break


@cell_rule("GW239", Severity.WARNING)
def owner_without_right(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """An owner whose role may not write what it owns."""
    modbus = cell.document.part(Modbus)
    if modbus is None or modbus.spec.tls is None:
        return
    for writer, role in _by_role(cell):
        spec = modbus.spec.tls.roles.get(role)
        if spec is None or not spec.write or ALL in spec.write:
            continue
        own = {variable.index for name in spec.write for variable in named_by(name, cell)}
        reported: set[Position] = set()  # a range on one line has a lock for each of its variables
        for lock in cell.locks:
            missing = [index for index in lock.members if index not in own]
            if writer.name in lock.owners and not lock.is_any and missing and lock.position not in reported:
                reported.add(lock.position)
                names = names_and_more(
                    list(dict.fromkeys(cell.variables[index].part.name for index in missing))
                )
                message = f"`{writer.name}` is an owner of {names}, but its role `{role}` may not write that"
                related = (Related(modbus.key_at("tls", "roles", role), f"the rights of `{role}`"),)
                hint = f"add it to `write:` of the role, or take `{writer.name}` from the owners"
                yield rule.at(lock.position, message, hint=hint, related=related)


def _by_role(cell: ExpandedCell) -> Iterator[tuple[Part[WriterSpec], str]]:
    for writer in cell.document.writers.values():
        role = writer.spec.by(ModbusWriter).role
        if role is not None:
            yield writer, role


def _roles(cell: ExpandedCell) -> Iterator[tuple[Part[Modbus], tuple[str, ...], RoleSpec]]:
    modbus = cell.document.part(Modbus)
    if modbus is None or modbus.spec.tls is None:
        return
    for role, spec in modbus.spec.tls.roles.items():
        yield modbus, ("tls", "roles", role), spec
    if modbus.spec.tls.without_role is not None:
        yield modbus, ("tls", "without_role"), modbus.spec.tls.without_role


def _granted(spec: RoleSpec) -> Mapping[str, Sequence[str]]:
    return {"read": spec.read, "write": spec.write}


def _as(known: RoleWriter) -> str:
    return known.text if known.network is not None else f"{known.text} from anywhere"

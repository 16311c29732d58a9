"""Roles of certificates, from the mapping file to the plan."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from gatewayd.links.modbus_server.plan import RoleRights, RoleWriter, SecuredPlan, TrustFiles
from gatewayd.links.modbus_server.sections import ModbusWriter
from gatewayd.links.modbus_server.tls_sections import ALL, RoleSpec, Tls
from gatewayd.mapping.expanded import ExpandedCell, ExpandedVariable


def secured_plan(tls: Tls, cell: ExpandedCell) -> SecuredPlan:
    """The listener with TLS of a cell without errors."""
    rights = [RoleRights(role, *_rights(spec, cell)) for role, spec in tls.roles.items()]
    if tls.without_role is not None:
        rights.append(RoleRights(None, *_rights(tls.without_role, cell)))
    writers = [
        known
        for index, writer in enumerate(cell.document.writers.values())
        for known in role_writers(writer.spec.by(ModbusWriter), index)
    ]
    return SecuredPlan(
        host=tls.listen.host,
        port=tls.listen.port,
        files=TrustFiles(tls.certificate, tls.key, tls.clients, tls.revoked),
        roles=tuple(sorted(rights, key=lambda its: (its.role is None, its.role or ""))),
        writers=tuple(sorted(writers, key=_specific_first)),
    )


def role_writers(writer: ModbusWriter, index: int) -> Iterator[RoleWriter]:
    """How a writer is known by its role; nothing where it has none."""
    if writer.role is not None:
        for network in writer.modbus or (None,):
            yield RoleWriter(writer.role, network, index)


def named_by(name: str, cell: ExpandedCell) -> list[ExpandedVariable]:
    """The variables that a name in a role stands for: a line, one of its variables, or a group."""
    return [
        variable
        for variable in cell.variables
        if name in (variable.part.name, variable.name, variable.spec.group)
    ]


def _rights(spec: RoleSpec, cell: ExpandedCell) -> tuple[tuple[int, ...] | None, tuple[int, ...] | None]:
    return _indices(spec.read, cell), _indices(spec.write, cell)


def _indices(names: Sequence[str], cell: ExpandedCell) -> tuple[int, ...] | None:
    if ALL in names:
        return None
    return tuple(sorted({variable.index for name in names for variable in named_by(name, cell)}))


def _specific_first(known: RoleWriter) -> tuple[str, bool, int, str]:
    network = known.network
    host_bits = 0 if network is None else network.max_prefixlen - network.prefixlen
    return known.role, network is None, host_bits, str(network)

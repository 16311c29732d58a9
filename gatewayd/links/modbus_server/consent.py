"""What of a new mapping's listener with TLS needs somebody who consents: more than before could be done, by more."""

from __future__ import annotations

from collections.abc import Iterator

from gatewayd.core.definition import CellDefinition
from gatewayd.links.modbus_server.plan import ModbusPlan, SecuredPlan
from gatewayd.report.wording import names_and_more


def weakened(
    old: ModbusPlan, new: ModbusPlan, before: CellDefinition, after: CellDefinition
) -> Iterator[str]:
    """Each promise of the listener with TLS that would be weaker, in words."""
    if old.tls is None:
        return
    if new.plain and not old.plain:
        yield "clients could connect to modbus without TLS too"
    if new.tls is None:
        return
    if old.tls.files.clients != new.tls.files.clients:
        yield f"other authorities would let clients in: clients {old.tls.files.clients} -> {new.tls.files.clients}"
    if old.tls.files.revoked is not None and new.tls.files.revoked is None:
        yield "revoked certificates would be accepted: revoked none"
    yield from _rights(old.tls, new.tls, before, after)
    yield from _writers(old, new, before, after)


def _rights(
    old: SecuredPlan, new: SecuredPlan, before: CellDefinition, after: CellDefinition
) -> Iterator[str]:
    for rights in new.roles:
        former = old.rights_of(rights.role)
        who = "certificates without a role" if rights.role is None else f"the role `{rights.role}`"
        for verb, had, has in (
            ("read", former.readable, rights.readable),
            ("write", former.writable, rights.writable),
        ):
            if had is None:
                continue
            known = {before.variables[index].name for index in had}
            if has is None:
                yield f"{who} could {verb} everything"
                continue
            names = [after.variables[index].name for index in has]
            more = [name for name in names if name not in known]
            if more:
                yield f"{who} could {verb} {names_and_more(more)} too"


def _writers(
    old: ModbusPlan, new: ModbusPlan, before: CellDefinition, after: CellDefinition
) -> Iterator[str]:
    """Writers that had to show a role, and would be known by an address alone."""
    assert old.tls is not None
    with_role = {before.writers[known.writer].name for known in old.tls.writers}
    for name in sorted({after.writers[writer].name for _network, writer in new.writers} & with_role):
        yield f"`{name}` would be known by its address alone, without a certificate"

"""What is looked at of a Modbus listener: address, port and who has it, privilege, the way to its clients."""

from __future__ import annotations

import asyncio
import os
import time
from collections.abc import AsyncIterator, Iterator
from functools import partial

from gatewayd.core.definition import CellDefinition
from gatewayd.links.examination import Examination, Observation, Surroundings
from gatewayd.links.modbus_server import diagnosis
from gatewayd.links.modbus_server.declaration import KIND
from gatewayd.links.modbus_server.plan import ModbusPlan, TrustFiles
from gatewayd.links.route import look_up_route
from gatewayd.loop.threads import in_daemon_thread
from gatewayd.machine.ports import bind_failure, holder, listening_inodes
from gatewayd.machine.privileges import NET_BIND_SERVICE, first_unprivileged_port, has_capability
from gatewayd.mapping.plan import LinkPlan
from gatewayd.report.format import address

_PATIENCE = 5.0
"""Seconds for a name server, where the listener is named."""


class ModbusExamination(Examination):
    """See the module."""

    async def examine(
        self, plan: LinkPlan, cell: CellDefinition, around: Surroundings
    ) -> AsyncIterator[Observation]:
        """See Examination."""
        assert isinstance(plan, ModbusPlan)
        for host, port in plan.endpoints:
            async for found in _listener(host, port, around):
                yield found
        if plan.tls is not None:
            for found in await in_daemon_thread(partial(_files, plan.tls.files), "certificates"):
                yield found
        for found in _clients(plan, cell):
            yield found


async def _listener(host: str, port: int, around: Surroundings) -> AsyncIterator[Observation]:
    """One address: whether the gateway has it, or could."""
    where = address(host, port)
    served = [
        link
        for known in around.running
        for link in known.links(KIND.title)
        if where in (link.get("listen"), (link.get("tls") or {}).get("listen"))
    ]
    if served:
        yield diagnosis.served(where, served)
    else:
        attempt = partial(bind_failure, host, port)
        try:
            async with asyncio.timeout(_PATIENCE):
                failure = await in_daemon_thread(attempt, f"bind {where}")
        except TimeoutError as error:
            failure = error
        facts = diagnosis.PortFacts(
            first_unprivileged_port(),
            has_capability(NET_BIND_SERVICE),
            holder(port),
            os.geteuid(),
            listened=any(listening_inodes(port)),
        )
        for found in diagnosis.listener(host, port, failure, facts):
            yield found


def _files(files: TrustFiles) -> list[Observation]:
    """The files of a listener with TLS, as this user can read them."""
    from gatewayd.links.modbus_server.trust import paths_of  # noqa: PLC0415 - where a unit has TLS
    from gatewayd.links.modbus_server.trust_findings import findings  # noqa: PLC0415

    paths = paths_of(files)
    found = [diagnosis.of_file(paths[its.key], its) for its in findings(files, time.time())]
    return found or [diagnosis.files_well(", ".join(paths.values()))]


def _clients(plan: ModbusPlan, cell: CellDefinition) -> Iterator[Observation]:
    """The way to each writer that is one machine."""
    for network, writer in plan.writers:
        if network.num_addresses == 1 and not network.is_loopback:
            name = cell.writers[writer].name
            for found in look_up_route(str(network.network_address), name):
                yield diagnosis.of_client(found, name, str(network.network_address))


EXAMINATION = ModbusExamination()
"""Looks at what this kind of link needs."""

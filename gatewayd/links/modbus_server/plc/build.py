"""From a compiled mapping to the model of one PLC's program."""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import Final

from gatewayd.core.definition import CellDefinition, Direction
from gatewayd.links.exports import ExportError
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.links.modbus_server.plc.model import PlcModel, RegisterTag
from gatewayd.links.modbus_server.plc.polling import numbered, read_polls, status_polls, write_polls
from gatewayd.links.modbus_server.plc.self_test import self_test_plan
from gatewayd.links.modbus_server.plc.tags import places, tag_of
from gatewayd.mapping.plan import Plan
from gatewayd.modbus.areas import Area
from gatewayd.plc.tags import PlcWishes, members, owners, renamed, writer_of
from gatewayd.report.printable import printable
from gatewayd.report.wording import one_and_more

_PERIOD: Final = 0.1
_HOST: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9.:%_-]{0,252}", re.ASCII)
_ANYWHERE: Final = frozenset({"0.0.0.0", "::"})


def model_of(plan: Plan, wishes: PlcWishes) -> PlcModel:
    """The model. Raises ExportError for a cell without Modbus, and where no program could do what the mapping says."""
    modbus = _modbus_of(plan)
    cell = plan.cell
    writer = writer_of(cell, {writer for _network, writer in modbus.writers}, wishes.writer, "Modbus")
    chosen = places(modbus.placements, cell)
    tags = renamed([tag_of(place, cell) for place in chosen.values()], wishes.names)
    outputs = [tag for tag in tags if cell.variables[tag.number - 1].direction is Direction.OUTPUT]
    inputs = [tag for tag in tags if writer is not None and writer + 1 in tag.owners]
    others = {
        place.address: cell.variables[index].name
        for index, place in chosen.items()
        if place.area is Area.HOLDING and cell.variables[index].direction is Direction.INPUT
        if writer not in owners(cell.variables[index], cell)
    }
    polls = [*status_polls(len(cell.variables)), *read_polls(outputs, modbus)]
    if writer is not None:
        polls += write_polls(inputs, cell, writer, others)
    return PlcModel(
        cell=cell.name,
        source=printable(PurePath(plan.source).name),
        fingerprint=cell.fingerprint,
        prefix=wishes.prefix,
        host=_host(wishes.host, modbus),
        port=modbus.port,
        unit=modbus.unit,
        writer="" if writer is None else cell.writers[writer].name,
        writer_number=0 if writer is None else writer + 1,
        writers=tuple(known.name for known in cell.writers),
        timeout=None if writer is None else cell.writers[writer].timeout,
        inputs=members(inputs),
        outputs=members(outputs),
        variables=tuple(variable.name for variable in cell.variables),
        polls=numbered(polls),
        left_out=tuple(_left_out(cell, chosen, inputs)),
        period=_PERIOD,
        self_test=None
        if wishes.handshake is None
        else self_test_plan(wishes.handshake, inputs, outputs, cell),
    )


def _host(wished: str | None, modbus: ModbusPlan) -> str:
    """How the PLC reaches the gateway. It stands in the program as a text: nothing that could end one may be in it."""
    if wished is None:
        if modbus.host in _ANYWHERE:
            raise ExportError(
                "the gateway listens at all addresses of its machine: say with --host by which the PLC reaches it"
            )
        return modbus.host
    if not _HOST.fullmatch(wished):
        raise ExportError(
            f"`{printable(wished)}` is no address: --host takes an IP address or the name of a host"
        )
    return wished


def refuse_name(host: str, client: str) -> None:
    """Raises ExportError where the client of a tool takes IPv4 addresses only, and the host is none."""
    try:
        ipaddress.IPv4Address(host)
    except ValueError:
        raise ExportError(
            f"{client} takes an IPv4 address, and `{host}` is none: say with --host how the PLC reaches the gateway"
        ) from None


def _modbus_of(plan: Plan) -> ModbusPlan:
    found = list(plan.of(ModbusPlan).values())
    if not found:
        raise ExportError(
            f"{plan.source}: the cell has no Modbus server: add `modbus: {{listen: 0.0.0.0:502}}`"
        )
    return found[0]


def _left_out(cell: CellDefinition, chosen: Mapping[int, object], inputs: Sequence[RegisterTag]) -> list[str]:
    """Inputs of other writers, and variables without a place on Modbus."""
    written = {tag.number for tag in inputs}
    foreign = [
        variable.name
        for index, variable in enumerate(cell.variables)
        if index in chosen and variable.direction is Direction.INPUT and variable.number not in written
    ]
    absent = [variable.name for index, variable in enumerate(cell.variables) if index not in chosen]
    found = []
    if foreign:
        found.append(f"{one_and_more(foreign)}: not written by this PLC")
    if absent:
        found.append(f"{one_and_more(absent)}: no place on Modbus")
    return found

"""The writers that a connection is: one in each cell whose mapping declares its address."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from gatewayd.core.cell import Cell
from gatewayd.core.requester import Requester
from gatewayd.links.modbus_server.session import UnitAccess

Accesses = Mapping[int, UnitAccess]
"""What one connection may do, by unit."""
Writers = list[tuple[Cell, Requester]]
"""What one connection is, each in its cell."""


def writers_of(accesses: Accesses) -> Writers:
    """The writers among them; a peer that can only read is none."""
    return [
        (access.unit.cell, access.requester)
        for access in accesses.values()
        if access.requester.writer is not None
    ]


def names_of(accesses: Accesses) -> tuple[str, ...]:
    """Their names, in the order of the units."""
    return tuple(_name(cell, requester) for cell, requester in writers_of(accesses))


def succeeded(writers: Writers, successors: Mapping[Cell, Cell]) -> Writers:
    """The same writers, of the same connection, in the cells that go on; without those that are declared no more."""
    found = []
    for cell, requester in writers:
        successor, name = successors.get(cell, cell), _name(cell, requester)
        indices = (i for i, writer in enumerate(successor.definition.writers) if writer.name == name)
        index = next(indices, None)
        if index is not None:
            found.append((successor, replace(requester, writer=index)))
    return found


def hold_anything(accesses: Accesses) -> bool:
    """Whether any lock follows the connection."""
    return any(cell.holds(requester.connection) for cell, requester in writers_of(accesses))


def _name(cell: Cell, requester: Requester) -> str:
    return "" if requester.writer is None else cell.definition.writers[requester.writer].name

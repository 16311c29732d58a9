"""What asking a device by hand has in common, whatever it speaks: where variables are mapped, nothing is written."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gatewayd.core.definition import CellDefinition, Direction
from gatewayd.links.access import AccessError, AccessProblem
from gatewayd.links.examination import RunningCell
from gatewayd.report.wording import names_and_more


def refuse_mapped(place: str, variables: Sequence[int], cell: CellDefinition) -> None:
    """Raise AccessError if variables of the cell lie at a place that is to be written."""
    if not variables:
        return
    found = [cell.variables[index] for index in dict.fromkeys(variables)]
    names = names_and_more([variable.name for variable in found])
    example = next((each for each in found if each.direction is Direction.OUTPUT), found[0])
    raise AccessError(
        AccessProblem.MAPPED,
        f"{place} is not written: {names} of cell {cell.name} is mapped there; "
        f"use `gatewayd force {example.name} VALUE`",
    )


@dataclass(frozen=True, slots=True)
class RunningDevice:
    """A device of a cell that a gateway on this machine serves now."""

    name: str
    cell: RunningCell
    status: Mapping[str, Any]
    """As the control interface has it (`DeviceKind.fields`)."""

    @property
    def words(self) -> str:
        """Who has it: `the gateway at /run/gatewayd/control.sock (cell press, device island)`."""
        return f"the gateway at {self.cell.socket} (cell {self.cell.name}, device {self.name})"


def running_devices(running: Sequence[RunningCell], family: str) -> Iterator[RunningDevice]:
    """All devices of a family that running gateways talk to."""
    for cell in running:
        for link in cell.status.get("links", ()):
            status = cell.status.get(link.get("name"))
            if isinstance(status, Mapping) and status.get("family") == family:
                yield RunningDevice(str(link["name"]), cell, status)

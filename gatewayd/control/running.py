"""Gateways that run on this machine, asked by their control sockets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from gatewayd.control.client import Client, ControlError, NoDaemon
from gatewayd.control.paths import SYSTEM_SOCKET, candidates
from gatewayd.links.examination import RunningCell

PATIENCE = 3.0
"""Seconds for each answer of a gateway."""


@dataclass(frozen=True, slots=True)
class RunningGateways:
    """What was found."""

    sockets: tuple[str, ...] = ()
    """Of gateways that answered."""
    cells: tuple[RunningCell, ...] = ()
    """All that they serve."""
    silent: tuple[tuple[str, str], ...] = ()
    """Sockets that are there and gave no answer, and why."""


def sockets(named: Path | None, environ: Mapping[str, str], system: Path = SYSTEM_SOCKET) -> list[Path]:
    """Where gateways may listen: the named socket alone, or all usual places, instances of the service among them."""
    if named is not None:
        return [named]
    places = [*candidates(environ), *sorted(system.parent.glob(f"*/{system.name}"))]
    return [place for place in dict.fromkeys(places) if _may_be_there(place)]


def ask(places: Sequence[Path], patience: float = PATIENCE) -> RunningGateways:
    """Ask each gateway what it serves."""
    answered: list[str] = []
    cells: list[RunningCell] = []
    silent: list[tuple[str, str]] = []
    for place in places:
        client = Client(place, patience)
        try:
            found = client.get("/v1/status")["cells"]
            for status in found:
                variables = client.get("/v1/variables", cell=status["name"])["variables"]
                cells.append(RunningCell(str(place), status, variables))
        except (NoDaemon, ControlError) as error:
            silent.append((str(place), str(error)))
        except (KeyError, TypeError):
            silent.append((str(place), f"what answers at {place} is not gatewayd"))
        else:
            answered.append(str(place))
    return RunningGateways(tuple(answered), tuple(cells), tuple(silent))


def _may_be_there(place: Path) -> bool:
    """Also where this user may not look: then the answer says so."""
    try:
        return place.exists()
    except PermissionError:
        return True
    except OSError:
        return False

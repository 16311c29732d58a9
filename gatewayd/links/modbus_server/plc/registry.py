"""The targets: a new one is a module and a line here."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Final, cast

from gatewayd.links.exports import ExportedFile
from gatewayd.links.modbus_server.plc.model import PlcModel
from gatewayd.links.modbus_server.plc.names import Holds, refuse_unfit

TARGETS: Final[Mapping[str, str]] = {
    "iec-st": "structured text of edition 2, for every tool",
    "codesys": "CODESYS 3: PLCopen XML, and a table of the channels",
    "twincat": "TwinCAT 3: a file for each object, client TF6250",
    "tia": "TIA Portal: external sources in SCL, client MB_CLIENT",
    "studio5000": "Studio 5000: data types and routines as L5X, tags as CSV",
    "c": "a C99 header, for soft PLCs and test benches",
}
"""Name -> what it is for. The module has the name with `_`."""


@dataclass(frozen=True, slots=True)
class PlcTool:
    """One tool: what it can hold, and what writes its files."""

    holds: Holds
    files: Callable[[PlcModel], Iterable[ExportedFile]]


def target_named(name: str) -> PlcTool:
    """The target, imported to use it."""
    module = import_module(f"gatewayd.links.modbus_server.plc.targets.{name.replace('-', '_')}")
    return PlcTool(cast("Holds", module.HOLDS), module.files)


def files_for(name: str, model: PlcModel, *, small: bool = False) -> tuple[ExportedFile, ...]:
    """All files of a target. Raises ExportError for what it cannot hold."""
    target = target_named(name)
    refuse_unfit(model, target.holds, small=small)
    return tuple(target.files(model))

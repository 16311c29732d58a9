"""The targets of `plc.export.TARGETS`: a module for each whose controllers can be a master, and why others cannot."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from importlib import import_module
from typing import Final

from gatewayd.links.canopen_node.plc.model import PdoModel
from gatewayd.links.exports import ExportedFile, ExportError
from gatewayd.plc.names import refuse_unfit

REFUSED: Final[Mapping[str, str]] = {
    "studio5000": (
        "Logix controllers are no CANopen master: let the PLC speak Modbus TCP (`modbus:` in the mapping), or take "
        "`--for iec-st` for what a third-party gateway hands over"
    ),
    "tia": (
        "S7 controllers are no CANopen master: a module such as the CM CANopen is one, and its configurator decides "
        "where the bytes of each PDO lie: import the EDS there, and take `--for iec-st` for the bytes; or let the PLC "
        "speak Modbus TCP (`modbus:` in the mapping)"
    ),
}
"""Target -> why it has no module, and what to do."""


def files_for(name: str, model: PdoModel, *, small: bool = False) -> tuple[ExportedFile, ...]:
    """All files of a target. Raises ExportError for what it cannot hold, and for what is no master."""
    if name in REFUSED:
        raise ExportError(REFUSED[name])
    target = import_module(f"gatewayd.links.canopen_node.plc.targets.{name.replace('-', '_')}")
    refuse_unfit(model, target.HOLDS, small=small)
    made: Iterable[ExportedFile] = target.files(model)
    return tuple(made)

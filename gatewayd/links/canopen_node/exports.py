"""The files for the configurator of a CANopen master, and for the engineering tool of a PLC that is one."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import Final

from gatewayd.links.canopen_node.plan import canopen_of
from gatewayd.links.exports import Export, ExportedFile, ExportError
from gatewayd.mapping.plan import Plan
from gatewayd.plc.export import plc_export
from gatewayd.plc.tags import PlcWishes


def _exported(plan: Plan, *, configured: bool) -> str:
    """A sheet that no other implementation understands otherwise; `configured` with the values of the mapping.

    What makes it and python-canopen are imported only here: the list of all exports needs neither.
    """
    from gatewayd.canopen.importer import differences
    from gatewayd.links.canopen_node.eds import dcf_text, eds_text, objects_of, sheet_of

    node = canopen_of(plan)
    if node is None:
        raise ExportError(
            f"{plan.source}: the cell is on no CAN bus: "
            "add `canopen: {channel: can0, bitrate: 500000, node: 16}`"
        )
    dictionary = objects_of(node, plan.cell)
    made = (dcf_text if configured else eds_text)(dictionary, sheet_of(node, plan.cell))
    found = differences(made, dictionary, node.node)
    if found:
        raise ExportError(f"not written, because python-canopen reads it differently: {'; '.join(found[:3])}")
    return made


def _plc_files(plan: Plan, wishes: PlcWishes, target: str, small: bool) -> Iterable[ExportedFile]:
    """Made by modules that are imported only here, like those of the sheet."""
    from gatewayd.links.canopen_node.plc.build import model_of
    from gatewayd.links.canopen_node.plc.registry import files_for

    return files_for(target, model_of(plan, wishes), small=small)


EXPORTS: Final = (
    plc_export("canopen", lambda plan: canopen_of(plan) is not None, _plc_files),
    Export(
        "eds",
        "The electronic data sheet, for the master's configurator.",
        """Write the electronic data sheet (CiA 306) of the node of a mapping FILE, for the configurator of the master.

        The sheet is written only after python-canopen's importer has read back every entry as it was meant. The same
        mapping gives the same bytes. The sheet is valid for any node-ID; COB-IDs beyond the four predefined ones of
        each direction are those of the mapping.
        """,
        ("gatewayd export eds my-cell.yaml -o my-cell.eds",),
        (),
        partial(_exported, configured=False),
    ),
    Export(
        "dcf",
        "The device configuration file: the EDS with node-ID, bit-rate and values.",
        """Write the device configuration file (CiA 306) of a mapping FILE: its data sheet with the node-ID, the
        bit-rate and the value of every parameter as the mapping has them.
        """,
        ("gatewayd export dcf my-cell.yaml -o my-cell.dcf",),
        (),
        partial(_exported, configured=True),
    ),
)

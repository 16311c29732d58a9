"""The files for the configurator of a CANopen master."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Final

from gatewayd.canopen.dictionary import Object
from gatewayd.links.canopen_node.eds import Sheet, dcf_text, eds_text, objects_of, sheet_of
from gatewayd.links.canopen_node.plan import canopen_of
from gatewayd.links.exports import Export, ExportError
from gatewayd.mapping.plan import Plan


def _exported(text: Callable[[Iterable[Object], Sheet], str], plan: Plan) -> str:
    """A sheet that no other implementation understands otherwise."""
    from gatewayd.canopen.importer import differences  # python-canopen takes a fifth of a second to import

    node = canopen_of(plan)
    if node is None:
        raise ExportError(
            f"{plan.source}: the cell is on no CAN bus: "
            "add `canopen: {channel: can0, bitrate: 500000, node: 16}`"
        )
    dictionary = objects_of(node, plan.cell)
    made = text(dictionary, sheet_of(node, plan.cell))
    found = differences(made, dictionary, node.node)
    if found:
        raise ExportError(f"not written, because python-canopen reads it differently: {'; '.join(found[:3])}")
    return made


EXPORTS: Final = (
    Export(
        "eds",
        "The electronic data sheet, for the master's configurator.",
        """Write the electronic data sheet (CiA 306) of the node of a mapping FILE, for the configurator of the master.

        The sheet is written only after python-canopen's importer has read back every entry as it was meant. The same
        mapping gives the same bytes. The sheet is valid for any node-ID; COB-IDs beyond the four predefined ones of
        each direction are those of the mapping.
        """,
        "gatewayd export eds my-cell.yaml -o my-cell.eds",
        partial(_exported, eds_text),
    ),
    Export(
        "dcf",
        "The device configuration file: the EDS with node-ID, bit-rate and values.",
        """Write the device configuration file (CiA 306) of a mapping FILE: its data sheet with the node-ID, the
        bit-rate and the value of every parameter as the mapping has them.
        """,
        "gatewayd export dcf my-cell.yaml -o my-cell.dcf",
        partial(_exported, dcf_text),
    ),
)

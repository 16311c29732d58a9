"""The files for the configurator of a CANopen master."""

from __future__ import annotations

from typing import Final

from gatewayd.canopen.dictionary import Dictionary
from gatewayd.links.canopen_node.eds import Commissioning, dcf_text, eds_text, objects_of, sheet_of
from gatewayd.links.canopen_node.plan import CanopenPlan, canopen_of
from gatewayd.links.exports import Export, ExportError
from gatewayd.mapping.plan import Plan

__all__ = ["EXPORTS"]


def _eds(plan: Plan) -> str:
    node = _node(plan)
    dictionary = objects_of(node, plan.cell)
    return _read_back(eds_text(dictionary, sheet_of(node, plan.cell, "eds")), dictionary, node)


def _dcf(plan: Plan) -> str:
    node = _node(plan)
    commissioning = Commissioning(node.node, node.bitrate, plan.cell.name)
    dictionary = objects_of(node, plan.cell)
    return _read_back(dcf_text(dictionary, sheet_of(node, plan.cell, "dcf"), commissioning), dictionary, node)


def _node(plan: Plan) -> CanopenPlan:
    node = canopen_of(plan)
    if node is None:
        raise ExportError(
            f"{plan.source}: the cell is on no CAN bus: "
            "add `canopen: {channel: can0, bitrate: 500000, node: 16}`"
        )
    return node


def _read_back(text: str, dictionary: Dictionary, node: CanopenPlan) -> str:
    """Let no sheet out that another implementation understands otherwise."""
    from gatewayd.canopen.importer import differences  # python-canopen takes a fifth of a second to import

    found = differences(text, dictionary, node.node)
    if found:
        raise ExportError(f"not written, because python-canopen reads it otherwise: {'; '.join(found[:3])}")
    return text


EXPORTS: Final = (
    Export(
        "eds",
        "The electronic data sheet, for the master's configurator.",
        """Write the electronic data sheet (CiA 306) of the node of a mapping FILE, for the configurator of the master.

        Before it is written, python-canopen's importer has read it back, every entry as it was meant. The same mapping
        gives the same bytes. The sheet is valid for any node-ID; COB-IDs beyond the four predefined of each direction
        are those of the mapping.
        """,
        "gatewayd export eds my-cell.yaml -o my-cell.eds",
        _eds,
    ),
    Export(
        "dcf",
        "The same with node-ID, bit-rate and values.",
        """Write the device configuration file (CiA 306) of a mapping FILE: its data sheet with the node-ID, the
        bit-rate and the value of every parameter as the mapping has them.
        """,
        "gatewayd export dcf my-cell.yaml -o my-cell.dcf",
        _dcf,
    ),
)

"""The variables on which the blocks work: what the master fills and sends, values, numbers, the status."""

from __future__ import annotations

from gatewayd.links.canopen_node.plc.model import PdoModel
from gatewayd.plc.st.dialect import own
from gatewayd.plc.st.program import PlcVariable


def data(model: PdoModel) -> tuple[PlcVariable, ...]:
    """One variable of each of the program's data types; those that the master fills and sends first."""
    prefix = model.prefix
    present = (
        ("from_node", "FromNode", bool(model.from_node)),
        ("to_node", "ToNode", bool(model.to_node)),
        ("status", "Status", True),
        ("numbers", "Numbers", True),
        ("inputs", "Inputs", bool(model.inputs)),
        ("outputs", "Outputs", bool(model.outputs)),
    )
    return tuple(PlcVariable(name, own(f"{prefix}_{kind}")) for name, kind, is_there in present if is_there)


def shared_data(model: PdoModel, *names: str) -> tuple[PlcVariable, ...]:
    """Those of the data on which a block works, by name."""
    return tuple(variable for variable in data(model) if variable.name in names)

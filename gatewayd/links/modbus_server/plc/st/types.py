"""The data types of the program: those that every link has, and the image of registers."""

from __future__ import annotations

from collections.abc import Iterator

from gatewayd.links.modbus_server.plc.model import PlcModel, Poll
from gatewayd.plc.st.dialect import Dialect, array
from gatewayd.plc.st.program import DataType, PlcVariable, Structure, TypeName
from gatewayd.plc.st.types import named_types, status_type, value_types


def data_types(model: PlcModel, dialect: Dialect) -> tuple[DataType, ...]:
    """All of them, what others are made of first."""
    image = Structure(f"{model.prefix}_Image", tuple(_arrays(model)), "registers as they go over the wire")
    return (*named_types(model, dialect), *value_types(model), image, status_type(model, dialect))


def array_type(poll: Poll) -> TypeName:
    """What one request carries."""
    return array("BOOL" if poll.area.of_bits else "WORD", poll.count - 1)


def _arrays(model: PlcModel) -> Iterator[PlcVariable]:
    for poll in model.polls:
        verb = "write" if poll.writes else "read"
        yield PlcVariable(
            poll.name,
            array_type(poll),
            f"FC {poll.function} {verb} {poll.notation} ({poll.address}), {poll.count}: {poll.what}",
        )

"""Where the SDO server is found on the bus (CiA 301, 7.5.2.33): object 1200h, which nobody can change."""

from __future__ import annotations

from collections.abc import Iterable

from gatewayd.canopen.cob_ids import Function
from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import Access, Entry, Object, record

__all__ = ["server_parameter"]


def server_parameter(node: int) -> Iterable[Object]:
    """1200h of the default server, whose COB-IDs follow the node-ID."""
    yield record(
        0x1200,
        "SDO server parameter",
        (
            _cob_id(1, "COB-ID client to server", Function.SDO_REQUEST + node),
            _cob_id(2, "COB-ID server to client", Function.SDO_RESPONSE + node),
        ),
    )


def _cob_id(subindex: int, name: str, cob_id: int) -> Entry:
    default = CanType.UNSIGNED32.pack(cob_id)
    return Entry(subindex, name, CanType.UNSIGNED32, Access.RO, default, plus_node=True)

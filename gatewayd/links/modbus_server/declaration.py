"""What everybody may know of this kind of link."""

from __future__ import annotations

from gatewayd.links.contract import LinkKind

__all__ = ["KIND"]


class ModbusServer(LinkKind):
    """The kind with the section `modbus`."""

    key = "modbus"
    title = "Modbus TCP server"


KIND = ModbusServer()

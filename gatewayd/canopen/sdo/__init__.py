"""SDO: the server through which a master reads and writes the object dictionary (CiA 301, 7.2.4)."""

from __future__ import annotations

from gatewayd.canopen.sdo.server import SdoServer

__all__ = ["SdoServer"]

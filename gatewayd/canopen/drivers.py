"""Which driver a bus has."""

from __future__ import annotations

from gatewayd.canopen.bus import BusHandler
from gatewayd.canopen.socketcan import SocketCanBus
from gatewayd.canopen.supervised import SupervisedBus


def make_bus(interface: str, channel: str, bitrate: int, handler: BusHandler) -> SupervisedBus:
    """The driver for an interface of python-can, not opened yet; `socketcan` has one of our own.

    `bitrate` is what interfaces are set to that have no configuration of their own; the kernel's have one.
    """
    if interface == "socketcan":
        return SocketCanBus(channel, handler)
    from gatewayd.canopen.pythoncan import PythonCanBus  # python-can takes a fifth of a second to import

    return PythonCanBus(interface, channel, bitrate, handler)

"""What everybody may know of this kind of link."""

from __future__ import annotations

from gatewayd.links.contract import LinkKind

__all__ = ["KIND"]


class CanopenNode(LinkKind):
    """The kind with the section `canopen`."""

    key = "canopen"
    title = "CANopen node"


KIND = CanopenNode()

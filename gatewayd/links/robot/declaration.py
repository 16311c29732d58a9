"""What everybody may know of this kind of link."""

from __future__ import annotations

from gatewayd.links.contract import LinkKind

__all__ = ["KIND"]


class Robot(LinkKind):
    """The kind with the section `robot`."""

    key = "robot"
    title = "Universal Robots controller"


KIND = Robot()

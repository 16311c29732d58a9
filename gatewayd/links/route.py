"""The route from this machine to an address, as kinds of links report it."""

from __future__ import annotations

import errno

from gatewayd.links.examination import Observation, Outcome
from gatewayd.machine.routes import Route, route_to

CHECK = "route"
_NONE = {errno.ENETUNREACH, errno.EHOSTUNREACH, errno.ENETDOWN}


def look_up_route(address: str, whom: str) -> list[Observation]:
    """The route that packages for `whom` (in words) take; one observation."""
    try:
        return [described(route_to(address), address, whom)]
    except OSError as error:
        if error.errno in _NONE:
            return [unreachable(address, whom)]
        return [Observation(CHECK, Outcome.SKIPPED, f"the kernel was not asked: {error.strerror or error}")]


def described(route: Route, address: str, whom: str) -> Observation:
    """What a route means."""
    if route.is_local:
        return Observation.well(CHECK, f"{address} is this machine")
    way = f"by {route.interface or 'an interface'}"
    if route.source:
        way += f" from {route.source}"
    if not route.has_link:
        return Observation(
            CHECK,
            Outcome.PROBLEM,
            f"{way}, but {route.interface} has no link",
            "the cable is not plugged in, the switch has no power, or the interface is down",
            f"plug in the cable, or `ip link set {route.interface} up`",
        )
    if route.gateway:
        text = f"{way} through {route.gateway}: {whom} is in another network"
        return Observation(CHECK, Outcome.NOTE, text)
    return Observation.well(CHECK, way)


def unreachable(address: str, whom: str) -> Observation:
    """There is no route."""
    return Observation(
        CHECK,
        Outcome.PROBLEM,
        f"this machine has no route to {address}",
        f"it has no address in the network of {whom}, and no default gateway",
        f"give an interface of this machine an address in the network of {whom}",
    )

"""Who may do what over the control interface: roles, and who asks. Pure.

Somebody on this machine, by the control socket, may do everything: the socket's permissions have judged. Who comes over
the network is what its token says.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from gatewayd.core.forcing import Holder


class Role(IntEnum):
    """What a token may do. A greater one may do all that a lesser one may."""

    VIEWER = 1
    """Read."""
    OPERATOR = 2
    """Take and release locks."""
    ENGINEER = 3
    """Force, end forces, reload the mapping."""

    @property
    def title(self) -> str:
        """As it is written."""
        return self.name.lower()


ROLES = {role.title: role for role in Role}
"""By what they are called."""


@dataclass(frozen=True, slots=True)
class Caller:
    """Who asks, and what it may do."""

    role: Role
    holder: Holder
    detail: str
    """As events and audit have it: `by anna`, `by token anna from 192.0.2.7`."""
    expires: float | None = None
    """Seconds since 1970 at which its token ends; None: not by itself."""
    reduced: str = ""
    """Why it may do less now than its token says; empty: it is as it says."""


def local_caller(user: str) -> Caller:
    """A user of this machine, on the control socket."""
    return Caller(Role.ENGINEER, Holder(user), f"by {user}")


def network_caller(role: Role, holder: Holder, peer: str, expires: float) -> Caller:
    """A token, from this address."""
    return Caller(role, holder, f"by {holder.title} from {peer}", expires)

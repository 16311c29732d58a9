"""The section `standby` of a mapping file."""

from __future__ import annotations

from ipaddress import ip_address
from typing import Annotated

from gatewayd.mapping import syntax
from gatewayd.mapping.scalars import Listen, OptionalDuration, one_or_many, refuse, scalar
from gatewayd.mapping.section import Section
from gatewayd.mapping.typed import AfterValidator, BeforeValidator, Field

GRACE = 10.0
"""Seconds for which adopted inputs wait for an owner after a takeover, where the file says nothing."""
MAX_PEERS = 2


def _two(peers: tuple[object, ...]) -> tuple[object, ...]:
    if len(peers) > MAX_PEERS:
        hint = "name the other gateway, or both"
        refuse(syntax.WRONG_TYPE, f"`peer` has {len(peers)} addresses", hint)
    return peers


def _virtual(value: object) -> str:
    hint = "write an IP address without port and prefix, for example 192.0.2.50"
    text = scalar(value, "an IP address", hint)
    try:
        return str(ip_address(text))
    except ValueError:
        refuse(syntax.BAD_NETWORK, f"`{text}` is not an IP address", hint)


_LISTEN_SCHEMA = Annotated[
    str, Field(pattern=r"^(\[[0-9A-Fa-f:.]+\]|[0-9.]+):[0-9]{1,5}$", examples=["192.0.2.12:2930"])
]


class Standby(Section):
    """A second gateway for the same robot."""

    peer: Annotated[
        tuple[Listen, ...],
        BeforeValidator(one_or_many, json_schema_input_type=_LISTEN_SCHEMA | list[_LISTEN_SCHEMA]),
        AfterValidator(_two),
    ] = Field(
        description="address and UDP port of the other gateway; or a list of both, so that the file is the same on "
        "both machines"
    )
    listen: Listen | None = Field(
        default=None,
        description="where this gateway hears the other; default: the same port as that, or its own entry of two in "
        "`peer`",
    )
    address: Annotated[
        str | None,
        BeforeValidator(_virtual, json_schema_input_type=Annotated[str, Field(examples=["192.0.2.50"])]),
    ] = Field(
        default=None,
        description="virtual address that keepalived moves to the gateway that serves the cell; default: none",
    )
    grace: OptionalDuration = Field(
        default=GRACE,
        description="how long adopted inputs wait for their owners after a takeover before they take on_release; none: "
        "for ever",
    )

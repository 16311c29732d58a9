"""The secured listener in a mapping file: `modbus: tls:`, its files, and what each role may do."""

from __future__ import annotations

from contextlib import suppress
from ipaddress import IPv6Address, ip_address
from typing import Annotated, Any, Final

from gatewayd.links.modbus_server.role import MAX_ROLE
from gatewayd.mapping import syntax
from gatewayd.mapping.diagnostics import declare
from gatewayd.mapping.scalars import Listen, ListenAddress, Names, refuse, scalar
from gatewayd.mapping.section import Section
from gatewayd.mapping.tables import read
from gatewayd.mapping.typed import BeforeValidator, Field, InstanceOf

PORT: Final = 802
"""Of Modbus/TCP Security (mbap-s)."""
ALL: Final = "all"
"""Stands for every variable; no variable and no group can be meant by this name in a role."""

BAD_ROLE = declare(
    "GW238", "bad-role-name", "a role that no certificate can have", home="gatewayd.links.modbus_server.rules"
)


def _role(value: object) -> str:
    hint = f"write the text of the certificate's role extension, 1 to {MAX_ROLE} characters: operator"
    text = scalar(value, "a role", hint)
    if not 1 <= len(text) <= MAX_ROLE or not text.isprintable():
        refuse(BAD_ROLE, f"{text!r} is not a role", hint)
    return text


def _file(value: object) -> str:
    hint = "write the whole path: /etc/gatewayd/tls/cell.crt"
    text = scalar(value, "the path of a file", hint)
    if not text.startswith("/") or not text.isprintable():
        refuse(syntax.WRONG_TYPE, f"`{text}` is not a path that begins with /: a service has no folder", hint)
    return text


def _listen(value: Any) -> ListenAddress:
    if isinstance(value, str):
        with suppress(ValueError):
            address = ip_address(value.strip("[]"))
            host = f"[{address}]" if isinstance(address, IPv6Address) else str(address)
            value = f"{host}:{PORT}"
    found: ListenAddress = read(Listen, value)
    return found


RoleName = Annotated[
    str,
    BeforeValidator(_role, json_schema_input_type=Annotated[str, Field(pattern="^.{1,64}$")]),
]
"""What the role extension of a certificate says."""
FilePath = Annotated[
    str,
    BeforeValidator(
        _file,
        json_schema_input_type=Annotated[str, Field(pattern="^/", examples=["/etc/gatewayd/tls/cell.crt"])],
    ),
]
"""A file of this machine."""
SecuredListen = Annotated[
    InstanceOf[ListenAddress],
    BeforeValidator(
        _listen,
        json_schema_input_type=Annotated[
            str,
            Field(pattern=r"^(\[[0-9A-Fa-f:.]+\]|[0-9.]+)(:[0-9]{1,5})?$", examples=["127.0.0.1:802"]),
        ],
    ),
]
"""A literal IP address, and a port; without one 802."""


class RoleSpec(Section):
    """What certificates with a role may do."""

    read: Names = Field(
        default=(), description="variables and groups that it may read, or all; default: nothing"
    )
    write: Names = Field(
        default=(),
        description="variables and groups that it may write where it is their writer, or all; default: nothing",
    )


class Tls(Section):
    """A listener with TLS (Modbus/TCP Security)."""

    listen: SecuredListen = Field(
        default=ListenAddress("127.0.0.1", PORT),
        description="address and port to listen on; the port may be left out",
        json_schema_extra={"default": "127.0.0.1:802"},
    )
    certificate: FilePath = Field(
        description="PEM file with the gateway's certificate and those between it and the authority"
    )
    key: FilePath = Field(description="PEM file with the key of that certificate, without a password")
    clients: FilePath = Field(description="PEM file with the authorities whose clients are let in")
    revoked: FilePath | None = Field(
        default=None,
        description="PEM file with the revocation lists of these authorities; default: none is looked at",
    )
    roles: dict[RoleName, RoleSpec] = Field(
        default_factory=dict,
        description="what each role may do; a role that is not named here may do nothing",
    )
    without_role: RoleSpec | None = Field(
        default=None, description="what certificates without a role may do; default: nothing"
    )

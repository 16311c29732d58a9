"""The role of a certificate: an extension of it (Modbus/TCP Security, R-21, R-22, R-65)."""

from __future__ import annotations

from gatewayd.machine.der import UTF8_STRING, DerError, only
from gatewayd.machine.x509 import Certificate

ROLE_OID = "1.3.6.1.4.1.50316.802.1"
MAX_ROLE = 64
"""Characters of a role."""


class RoleError(ValueError):
    """A role that cannot be believed; the text says why."""


def role_of(certificate: Certificate) -> str | None:
    """The role; None: it has none, the NULL role (R-23). Raises RoleError."""
    found = certificate.of(ROLE_OID)
    if not found:
        return None
    if len(found) > 1:
        raise RoleError(f"{len(found)} role extensions, where exactly one is allowed (R-65)")
    try:
        role = only(found[0].value).expect(UTF8_STRING).content.decode("utf-8")
    except (DerError, UnicodeDecodeError) as error:
        raise RoleError("the role extension is not one UTF8String (R-21, R-22)") from error
    if not role or len(role) > MAX_ROLE or not role.isprintable():
        raise RoleError(f"the role has not 1 to {MAX_ROLE} characters that can be shown")
    return role

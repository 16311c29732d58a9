"""What a peer has shown of itself on a secured listener."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PeerCredentials:
    """As much of its certificate as anybody asks for."""

    role: str | None
    """None: its certificate has none."""
    name: str
    """The name of its holder, for people: `CN=plc-1`."""
    serial: int
    issuer: bytes
    """DER of the name."""
    not_after: float
    """Seconds since 1970."""

    @property
    def text(self) -> str:
        """`role operator`, `no role`."""
        return "no role" if self.role is None else f"role {self.role}"

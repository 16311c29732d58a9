"""Who controls which controller input: the lock behind IN_USE (guide, SETUP_INPUTS).

An owner is any hashable object; one field has at most one. Another owner's claim for it is refused, its own is
granted again: the same field may stand in several recipes of one connection.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable


class ControllerClaims:
    """The claims of one controller."""

    def __init__(self) -> None:
        self._owners: dict[str, Hashable] = {}

    def owner(self, field: str) -> Hashable | None:
        """Who holds `field`, None if it is free."""
        return self._owners.get(field)

    def held(self, owner: Hashable) -> tuple[str, ...]:
        """The fields of `owner`, in the order they were claimed."""
        return tuple(field for field, holder in self._owners.items() if holder == owner)

    def taken(self, owner: Hashable, fields: Iterable[str]) -> frozenset[str]:
        """Those of `fields` that somebody else than `owner` holds."""
        return frozenset(field for field in fields if self._owners.get(field, owner) != owner)

    def claim(self, owner: Hashable, fields: Iterable[str]) -> frozenset[str]:
        """Give `fields` to `owner`: all of them, or none and return those that stand against it."""
        wanted = tuple(fields)
        taken = self.taken(owner, wanted)
        if not taken:
            self._owners.update(dict.fromkeys(wanted, owner))
        return taken

    def release(self, owner: Hashable, fields: Iterable[str] | None = None) -> None:
        """Free `fields` as far as `owner` holds them; without `fields` everything it holds."""
        for field in self.held(owner) if fields is None else tuple(fields):
            if self._owners.get(field) == owner:
                del self._owners[field]

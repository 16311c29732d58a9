"""What every table of a mapping file has in common."""

from __future__ import annotations

from typing import TypeVar

from gatewayd.mapping.tables import TypedTable

S = TypeVar("S", bound="Section")


class Section(TypedTable):
    """Anything that is a table in the file."""

    def by(self, keys: type[S]) -> S:
        """The same with the keys that one kind of link has here; they are there in every file (`mapping.language`)."""
        assert isinstance(self, keys)
        return self

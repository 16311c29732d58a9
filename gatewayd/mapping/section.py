"""What every table of a mapping file has in common."""

from __future__ import annotations

from typing import TypeVar

from pydantic import BaseModel, ConfigDict

S = TypeVar("S", bound="Section")


class Section(BaseModel):
    """Anything that is a table in the file: strict types, no unknown keys, immutable."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, defer_build=True)

    def by(self, keys: type[S]) -> S:
        """The same with the keys that one kind of link has here; they are there in every file (`mapping.language`)."""
        assert isinstance(self, keys)
        return self

"""What the claimed inputs hold: by which lists of outputs that is read, and what came of it.

The working recipe has the wanted outputs and, where `read_back` is wanted, the inputs behind them. Where that is more
than an old controller takes as one list, as many inputs as fit stay in it. What it does not have is read in pieces
before it is set up: nothing that was claimed is left unread because a list was too long.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from gatewayd.rtde.catalogue import OLD_LIST_LIMIT
from gatewayd.rtde.codec import ProtocolError
from gatewayd.rtde.recipe import Recipe, Scalar
from gatewayd.rtde.session import Wishes
from gatewayd.rtde.types import DataType


def fitting(names: Iterable[str], limit: int = OLD_LIST_LIMIT) -> tuple[str, ...]:
    """Those of `names` that a list of `limit` bytes has room for, first come, first served."""
    taken: list[str] = []
    size = -1
    for name in names:
        if size + 1 + len(name) <= limit:
            taken.append(name)
            size += 1 + len(name)
    return tuple(taken)


class Reading:
    """The lists of outputs of one connection."""

    def __init__(self, wishes: Wishes, *, limited: bool = False) -> None:
        self.limited = wishes.limited or limited
        """Whether lists are limited."""
        self._outputs = wishes.wanted_outputs()
        self._read_backs = wishes.read_backs()
        self._verifies = wishes.read_back
        self.refused: dict[str, str] = {}
        """Fields that cannot be read at all, with the controller's word for each."""
        self.held: dict[str, tuple[Scalar, ...]] = {}
        """What was read in pieces."""
        self._types: dict[str, DataType] = {}
        self._piece: Recipe | None = None

    @property
    def left_out(self) -> Mapping[str, bool]:
        """Fields that the working recipe has no room for; whether it is an input's read-back."""
        chosen = frozenset(self.working())
        read_backs = dict.fromkeys(self._read_backs, True) if self._verifies else {}
        wanted = dict.fromkeys(self._outputs, False) | read_backs
        return {
            name: read_back
            for name, read_back in wanted.items()
            if name not in chosen and name not in self.refused
        }

    def working(self) -> tuple[str, ...]:
        """The list of the working recipe."""
        wanted = (*self._outputs, *(self._read_backs if self._verifies else ()))
        offered = [name for name in wanted if name not in self.refused]
        return fitting(offered) if self.limited else tuple(offered)

    def agree(self, recipe: Recipe) -> None:
        """The working recipe is set up: it reads what it has."""
        self._types |= recipe.kinds

    def piece(self, claimed: Mapping[str, DataType]) -> tuple[str, ...]:
        """The next list to read of the claimed fields; empty when there is nothing left to read."""
        working = frozenset(self.working())
        return fitting(
            name
            for name in claimed
            if name.startswith("input_")
            and not (name in working or name in self.held or name in self.refused)
        )

    def expect(self, piece: Recipe) -> None:
        """The controller accepted this piece."""
        self._piece = piece

    def take(self, payload: bytes) -> bool:
        """Take the package of the piece; False if it is none of it."""
        piece = self._piece
        assert piece is not None
        try:
            flat = piece.unpack(payload)
        except ProtocolError:
            return False
        self._types |= piece.kinds
        self.held |= {name: flat[slot] for name, slot in piece.slots.items()}
        return True

    def unread(self, claimed: Mapping[str, DataType]) -> frozenset[str]:
        """Those of the claimed fields, with their types, of which nothing shows what they hold.

        What reads as another type than it is written counts among them.
        """
        return frozenset(
            name
            for name, kind in claimed.items()
            if not name.startswith("input_") or self._types.get(name) is not kind
        )

"""The tokens that count now, and the end of what those held that count no more. Pure but for reading the file.

The file is the truth. One that is gone revokes every token, once it was missed twice: editors that save by renaming
leave it absent for a moment. One that cannot be read (a slip of an editor) revokes
none, because a release moves actuators: the tokens that were read before still read, and what they hold stays theirs
until its time, but nothing can be changed by any, so that one that was to be revoked does no more; and it is reported.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path

from gatewayd.control.access import Caller, Role, network_caller
from gatewayd.control.token_file import read_tokens
from gatewayd.control.tokens import TokenFileError, TokenSet
from gatewayd.core.cell import Cell
from gatewayd.core.forcing import Holder
from gatewayd.machine.certificates import FileWatch


class Judgement(Enum):
    """What a header makes of a request."""

    NONE = "no token"
    WRONG = "wrong token"
    ENDED = "expired token"


@dataclass(frozen=True, slots=True)
class Unidentified:
    """Why nobody is known to ask."""

    judgement: Judgement
    text: str
    """What the client is answered, and how it gets further."""


ASK = "this needs a token: Authorization: Bearer TOKEN"
_UNREADABLE = "while the gateway cannot read its file of tokens, all of them only read; its log says why"
_WRONG = Unidentified(
    Judgement.WRONG, "the token is not one of the gateway's; gatewayd token list shows who has one"
)


class Credentials:
    """Those of one file; `cells` are served now."""

    def __init__(self, path: Path, cells: Callable[[], Iterable[Cell]]) -> None:
        self.path = path
        self.tokens = TokenSet()
        self.fault = ""
        """Why the file is not what counts; empty: it is."""
        self._cells = cells
        self._watch = FileWatch((path,))
        self._was_missed = False

    def refresh(self) -> bool:
        """Read the file if it changed; whether it did. It may wait for a file system: call it in a thread."""
        was_missed, self._was_missed = self._was_missed, False
        if not self._watch.changed() and not was_missed:
            return False
        try:
            self.tokens, self.fault = read_tokens(self.path), ""
        except FileNotFoundError:
            self.fault = f"{self.path}: No such file or directory; gatewayd token create"
            if was_missed:
                self.tokens = TokenSet()
            else:
                self._was_missed = True
        except TokenFileError as error:
            self.fault = str(error)
        except Exception as error:
            self.fault = f"{self.path}: {error}"  # else one that was to be revoked would go on
            raise
        return True

    def identify(self, header: str | None, peer: str, wall: float) -> Caller | Unidentified:
        """Who asks, by the header Authorization (RFC 6750, 2.1)."""
        if header is None:
            return Unidentified(Judgement.NONE, ASK)
        scheme, _, given = header.partition(" ")
        if scheme.lower() != "bearer":
            return Unidentified(Judgement.NONE, ASK)
        token = self.tokens.find(given.strip())
        if token is None:
            return _WRONG
        fault = token.fault(wall)
        if fault:
            return Unidentified(Judgement.ENDED, fault)
        return self._as_it_may(network_caller(token.role, token.holder, peer, token.expires))

    def current(self, caller: Caller, wall: float) -> Caller | None:
        """The same caller as its token is now: who may do less meanwhile; None: it counts no more."""
        if not self.is_current(caller.holder, wall):
            return None
        token = next(token for token in self.tokens.tokens if token.holder == caller.holder)
        return self._as_it_may(replace(caller, role=token.role, reduced=""))

    def is_current(self, holder: Holder, wall: float) -> bool:
        """Whether this token still counts."""
        return any(token.holder == holder and not token.fault(wall) for token in self.tokens.tokens)

    def end_what_ended(self, now: float, wall: float) -> list[str]:
        """End what tokens hold that count no more; which they were. Cheap while no token holds anything."""
        ended = []
        for cell in self._cells():
            for holder in self._gone(cell, wall):
                reason = self._reason(holder, wall)
                cell.operator.end_of(lambda one, gone=holder: one == gone, now, reason)  # type: ignore[misc]
                ended.append(reason)
        return list(dict.fromkeys(ended))

    def _gone(self, cell: Cell, wall: float) -> list[Holder]:
        forcing = cell.forcing
        if not forcing.forces and not forcing.holds:
            return []
        holders = [
            *(hold.holder for hold in forcing.holds.values()),
            *(one.holder for one in forcing.forces.values()),
        ]
        return [
            holder
            for holder in dict.fromkeys(holders)
            if holder.credential and not self.is_current(holder, wall)
        ]

    def _reason(self, holder: Holder, wall: float) -> str:
        known = next((token for token in self.tokens.tokens if token.holder == holder), None)
        return known.fault(wall) if known is not None else f"the token {holder.name} was revoked"

    def _as_it_may(self, caller: Caller) -> Caller:
        """While the file cannot be read, nobody knows who was to be revoked."""
        return replace(caller, role=Role.VIEWER, reduced=_UNREADABLE) if self.fault else caller

"""Who may use the status listener: its settings, tokens, certificate, and what was refused. Outlives the listener."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from ssl import SSLContext, SSLError

from gatewayd.core.cell import Cell
from gatewayd.machine.certificates import CertificateFiles, ServerIdentity
from gatewayd.web.credentials import Credentials
from gatewayd.web.encryption import USUAL_COST, handshake_cost, server_context
from gatewayd.web.settings import Settings
from gatewayd.web.throttle import WrongTokens

REFUSALS = {
    "host": "called by a name that is not declared",
    "origin": "sent by a page of another site",
    "no_token": "without a token",
    "wrong_token": "with a wrong one",
    "expired_token": "with one that has expired",
    "role": "with one whose role is too little",
    "handshake": "TLS handshakes that failed",
    "malformed": "not HTTP",
    "peer": "connections past the declared proxy",
}
"""Reason -> what was refused, for the metric."""
TOKEN_SOON = 14 * 86400.0
"""Seconds before its end at which a token is reported."""


class AccessControl:
    """That of one listener; `cells` are served now."""

    def __init__(self, settings: Settings, cells: Callable[[], Iterable[Cell]] = lambda: ()) -> None:
        self.settings = settings
        self.credentials = (
            Credentials(settings.token_file, cells) if settings.token_file is not None else None
        )
        tls = settings.tls
        files = None if tls is None else CertificateFiles(tls.certificate, tls.key)
        self.identity = (
            ServerIdentity(files, server_context, prove=self._measure) if files is not None else None
        )
        self.handshake_cost = USUAL_COST
        self.refused = Counter(dict.fromkeys(REFUSALS, 0))
        self.wrong_tokens = WrongTokens()

    def refresh(self) -> None:
        """Read what changed of the files. It may wait for a file system: call it in a thread."""
        if self.credentials is not None:
            self.credentials.refresh()
        if self.identity is not None:
            self.identity.refresh()

    def _measure(self, context: SSLContext) -> str:
        """Note what a handshake costs; why none succeeds, say with a key that no cipher is for. Empty: it does."""
        try:
            self.handshake_cost = handshake_cost(context)
        except SSLError as error:
            return f"no client can use it: {error.reason}"
        return ""

    @property
    def obstacle(self) -> str:
        """Why it must not listen now; empty: it may."""
        if self.settings.obstacle or self.identity is None or self.identity.context is not None:
            return self.settings.obstacle
        return self.identity.fault or "the certificate was not read yet"

    def troubles(self, wall: float) -> list[str]:
        """What somebody has to do about it; the cells are served all the same."""
        return [f"status listener: {trouble}" for trouble in self._troubles(wall)]

    def _troubles(self, wall: float) -> Iterator[str]:
        if self.settings.obstacle:
            yield f"not open: {self.settings.obstacle}"
        if self.identity is not None:
            trouble = self.identity.trouble(wall)
            if trouble:
                yield trouble
        if self.credentials is not None:
            if self.credentials.fault:
                yield f"nothing can be changed with a token: {self.credentials.fault}"
            for token in self.credentials.tokens.tokens:
                if 0 < token.expires - wall < min(TOKEN_SOON, (token.expires - token.created) / 4):
                    yield f"the token {token.name} ends in {(token.expires - wall) / 86400:.1f} days"

"""The tokens by which others than this machine's users are known: a file of names, roles and hashes. Pure.

A token is 256 bits from the operating system, so nobody guesses one, and a plain SHA-256 keeps it: slow hashes (scrypt,
bcrypt) protect what people think up, by making each guess expensive, and here there is nothing to guess. It costs the
robots' loop 20 microseconds for each request instead of 50 milliseconds.
"""

from __future__ import annotations

import hmac
import json
import re
from base64 import urlsafe_b64encode
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from hashlib import sha256
from typing import Any

from gatewayd.control.access import ROLES, Role
from gatewayd.core.forcing import Holder

PREFIX = "gatewayd_"
"""Of every token, so that scanners for published secrets, and people, know what it is."""
RANDOM_BYTES = 32
MAX_TOKENS = 64
MAX_GIVEN = 256
"""Characters of what is looked at as a token."""
SKEW = 300.0
"""Seconds by which a token may come from the future: two clocks are never the same."""

_FORMAT = 1
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,31}")
_HASH = re.compile(r"[0-9a-f]{64}")
_KEYS = {"name", "role", "sha256", "created", "expires"}
_LIKE_A_TOKEN = re.compile(rf"{PREFIX}[A-Za-z0-9_-]+")
_TIME = "%Y-%m-%dT%H:%M:%SZ"


class TokenFileError(ValueError):
    """A file of tokens that cannot be used; the text says what is wrong and what to do."""


@dataclass(frozen=True, slots=True)
class Token:
    """One token. The token itself is nowhere: `digest` is its SHA-256. Times are seconds since 1970."""

    name: str
    role: Role
    digest: str
    created: float
    expires: float

    @property
    def holder(self) -> Holder:
        """As whom it takes and forces. Another token of the same name, or with another role, is another one."""
        return Holder(self.name, f"{self.digest} {self.role.title}")

    def has_ended(self, wall: float) -> bool:
        """Whether it counts no more."""
        return wall >= self.expires

    def fault(self, wall: float) -> str:
        """Why it does not count at this time; empty: it does."""
        if self.has_ended(wall):
            return f"the token {self.name} expired on {utc_text(self.expires)}"
        if wall < self.created - SKEW:
            return f"the token {self.name} was made on {utc_text(self.created)}: the clock here is behind"
        return ""


@dataclass(frozen=True, slots=True)
class TokenSet:
    """The tokens of one file, in its order."""

    tokens: tuple[Token, ...] = ()

    def find(self, given: str) -> Token | None:
        """The token that was given. All are compared, each in constant time."""
        if not given or len(given) > MAX_GIVEN:
            return None
        digest, found = digest_of(given), None
        for token in self.tokens:
            if hmac.compare_digest(digest, token.digest):
                found = token
        return found

    def named(self, name: str) -> Token | None:
        """The token of this name."""
        return next((token for token in self.tokens if token.name == name), None)

    def with_token(self, token: Token, wall: float) -> TokenSet:
        """With one more, and without those that have expired. Raises TokenFileError."""
        if not _NAME.fullmatch(token.name):
            raise TokenFileError(
                f"{token.name!r} is no name: letters, digits, '.', '_' and '-', beginning with a letter or digit, "
                "32 at most"
            )
        former = self.named(token.name)
        if former is not None and not former.has_ended(wall):
            raise TokenFileError(
                f"there is a token {token.name} already: revoke it first, or take another name"
            )
        kept = [one for one in self.tokens if one is not former and not one.has_ended(wall)]
        if len(kept) >= MAX_TOKENS:
            raise TokenFileError(f"{MAX_TOKENS} tokens are there already: revoke some")
        return TokenSet((*kept, token))

    def without(self, name: str) -> TokenSet:
        """All but the one of this name."""
        return TokenSet(tuple(token for token in self.tokens if token.name != name))


def new_token(name: str, role: Role, wall: float, seconds: float, random: bytes) -> tuple[Token, str]:
    """A token that counts from now for so many seconds, and its text, which only its holder keeps."""
    if len(random) != RANDOM_BYTES:
        raise ValueError(f"a token needs {RANDOM_BYTES} random bytes")
    text = PREFIX + urlsafe_b64encode(random).rstrip(b"=").decode()
    created = float(int(wall))
    return Token(name, role, digest_of(text), created, created + float(int(seconds))), text


def digest_of(text: str) -> str:
    """What is kept of a token."""
    return sha256(text.encode("utf-8", "surrogateescape")).hexdigest()


def without_tokens(text: str) -> str:
    """A text that somebody else gave, for the log: what begins as a token is cut off."""
    return _LIKE_A_TOKEN.sub(f"{PREFIX}...", text)


def utc_text(wall: float) -> str:
    """`2026-11-29T14:00:00Z`."""
    return datetime.fromtimestamp(wall, UTC).strftime(_TIME)


# -- the file --------------------------------------------------------------------------------------------------------


def as_text(tokens: TokenSet) -> str:
    """The file: JSON, one token on each line."""
    lines = [json.dumps(_as_object(token)) for token in tokens.tokens]
    inside = ",\n  ".join(lines)
    return f'{{"gatewayd_tokens": {_FORMAT}, "tokens": [{inside and f"{chr(10)}  {inside}{chr(10)}"}]}}\n'


def parse(text: bytes) -> TokenSet:
    """The tokens of a file. Raises TokenFileError."""
    try:
        content = text.decode()
    except UnicodeDecodeError:
        raise TokenFileError("not a text file") from None
    if not content.lstrip().startswith("{"):
        raise TokenFileError(
            "not a file of tokens; move it away and give each user a token: gatewayd token create NAME --role ROLE"
        )
    try:
        found = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise TokenFileError(f"not JSON: {error}") from None
    if not isinstance(found, dict) or found.get("gatewayd_tokens") != _FORMAT or len(found) != 2:
        raise TokenFileError(f'not a file of tokens of version {_FORMAT} ("gatewayd_tokens": {_FORMAT})')
    entries = found.get("tokens")
    if not isinstance(entries, list) or len(entries) > MAX_TOKENS:
        raise TokenFileError(f'"tokens" is not a list of {MAX_TOKENS} at most')
    tokens = tuple(_token(entry, number) for number, entry in enumerate(entries, 1))
    for what, values in (("name", [one.name for one in tokens]), ("sha256", [one.digest for one in tokens])):
        twice = _first_twice(values)
        if twice is not None:
            raise TokenFileError(f"token {twice}: another one has the same {what}")
    return TokenSet(tokens)


def _as_object(token: Token) -> Mapping[str, object]:
    return {
        "name": token.name,
        "role": token.role.title,
        "sha256": token.digest,
        "created": utc_text(token.created),
        "expires": utc_text(token.expires),
    }


def _token(entry: Any, number: int) -> Token:
    if not isinstance(entry, dict) or entry.keys() != _KEYS:
        raise TokenFileError(f"token {number}: not an object with {', '.join(sorted(_KEYS))}")
    name, role, digest = entry["name"], entry["role"], entry["sha256"]
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise TokenFileError(f"token {number}: `name` is no name")
    if not isinstance(role, str) or role not in ROLES:
        raise TokenFileError(f"token {number}, {name}: `role` is not one of {', '.join(ROLES)}")
    if not isinstance(digest, str) or not _HASH.fullmatch(digest):
        raise TokenFileError(f"token {number}, {name}: `sha256` is not 64 hexadecimal digits")
    created, expires = (
        _time(entry[key], f"token {number}, {name}: `{key}`") for key in ("created", "expires")
    )
    return Token(name, ROLES[role], digest, created, expires)


def _time(value: object, where: str) -> float:
    try:
        return (
            datetime.strptime(value if isinstance(value, str) else "", _TIME).replace(tzinfo=UTC).timestamp()
        )
    except ValueError:
        raise TokenFileError(f"{where} is not a time like 2026-11-29T14:00:00Z") from None


def _first_twice(values: Iterable[str]) -> int | None:
    seen: set[str] = set()
    for number, value in enumerate(values, 1):
        if value in seen:
            return number
        seen.add(value)
    return None

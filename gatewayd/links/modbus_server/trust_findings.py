"""What is wrong with the files of a listener with TLS, or will be soon: for `check`, `doctor` and health."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

from gatewayd.links.modbus_server.plan import TrustFiles
from gatewayd.links.modbus_server.trust import FileFacts, TrustError, load, look

_DAY = 86400.0
SOON = {"certificate": 30 * _DAY, "clients": 30 * _DAY, "revoked": 7 * _DAY}
"""Seconds before an expiry from which on it is reported. Many authorities issue a revocation list each month."""
_WHAT = {
    "certificate": ("the gateway's certificate", "clients refuse the gateway", "renew it"),
    "clients": (
        "an authority of the clients",
        "its clients are refused",
        "renew it, and name both for a while",
    ),
    "revoked": ("a revocation list", "nobody new is let in", "have the authority issue a new list"),
}


@dataclass(frozen=True, slots=True)
class TrustFinding:
    """One thing."""

    key: str
    """Of the file, in the mapping."""
    text: str
    """After its path."""
    remedy: str
    unusable: bool = False
    """Nobody can be served."""


def findings(files: TrustFiles, now: float) -> Iterator[TrustFinding]:
    """What is wrong with these files at `now` (seconds since 1970). Reads disks."""
    try:
        facts = look(files)
    except TrustError as error:
        yield _unusable(error)
        return
    try:
        load(files, now)
    except TrustError as error:
        yield _unusable(error)
    yield from of_facts(facts, now)


def of_facts(facts: FileFacts, now: float) -> Iterator[TrustFinding]:
    """The same of files that could be read."""
    yield from expiring(facts, now)
    if facts.chain and facts.chain[0].not_before > now:
        yield TrustFinding(
            "certificate", f"is valid from {_day(facts.chain[0].not_before)} on", "compare the clocks"
        )
    if facts.chain and not facts.is_whole_chain:
        text = "does not have the whole chain down to the authority itself (R-46)"
        yield TrustFinding(
            "certificate", text, "put the certificates behind each other: cat cell.crt authority.crt"
        )
    if facts.exposed:
        yield TrustFinding("key", "can be read by everybody on this machine", "chmod o-r")


def expiring(facts: FileFacts, now: float) -> Iterator[TrustFinding]:
    """What has expired, or will within `SOON`."""
    for key, at in facts.expiries.items():
        what, effect, remedy = _WHAT[key]
        if at <= now:
            yield TrustFinding(key, f"has expired: {what}, on {_day(at)}; {effect}", remedy, unusable=True)
        elif at - now < SOON[key]:
            days = int((at - now) // _DAY)
            yield TrustFinding(
                key, f"expires in {days} days: {what}, on {_day(at)}; from then on {effect}", remedy
            )


def _unusable(error: TrustError) -> TrustFinding:
    return TrustFinding(error.key, error.text, error.remedy, unusable=True)


def _day(at: float) -> str:
    return time.strftime("%Y-%m-%d", time.gmtime(at))

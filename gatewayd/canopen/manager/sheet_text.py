"""The text of a data sheet (EDS or DCF, CiA 306) before it is imported, and the numbers in it.

Files of vendors are not always what the specification says. What is known to stop python-canopen's importer is put
right here:

- a key without a value (`PDOMapping=`) is one that is missing; an object without a name is called by its index;
- dummy usage and comments, incomplete in some files, are left out: nothing needs them.

And numbers are read here, because the importer reads some of them as something else or not at all: hexadecimal ones of
signed types are two's complements, `0x-5` is -5, and the node-ID may stand at any place of a sum (`$NODEID+0x180`,
`0x180 + $NODEID`, `$NodeId`).
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from datetime import UTC, datetime

from gatewayd.canopen.clock import EPOCH

_SECTION = re.compile(r"\s*\[([^\]]*)\]")
_KEY = re.compile(r"\s*([^=;\[]+?)\s*=\s*(.*?)\s*(?:\s;.*)?$")
_LEFT_OUT = {"dummyusage", "comments"}
_MINUS = re.compile(r"^0X-")
_DATE_FORMATS = ("%m-%d-%Y %I:%M%p", "%m-%d-%Y %H:%M", "%m-%d-%Y")


@dataclass(slots=True)
class SheetText:
    """What the importer is given, and what is needed of the text beside it."""

    text: str
    compact: dict[int, int] = field(default_factory=dict)
    """Index of an array described in one piece -> its highest sub-index."""
    modified: tuple[int, int] | None = None
    """Days since 1984 and milliseconds of the day at which the file was changed; None if it does not say."""


def decoded(data: bytes) -> str:
    """The text of a file: UTF-8, or what older tools of Windows write."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace")


def repaired(text: str) -> SheetText:
    """The text as the importer can read it."""
    section, lines, found, info = "", [], SheetText(""), {}
    for line in text.splitlines():
        heading = _SECTION.match(line)
        if heading is not None:
            section = heading[1].strip()
        if section.lower() in _LEFT_OUT:
            continue
        key = None if heading is not None else _KEY.match(line)
        if key is not None:
            name, value = key[1], key[2]
            if name.lower() == "parametername" and not value:
                lines.append(f"{name}={section}")
                continue
            if not value:
                continue
            if section.lower() == "fileinfo":
                info[name.lower()] = value
            elif name.lower() == "compactsubobj" and re.fullmatch("[0-9A-Fa-f]{4}", section):
                found.compact[int(section, 16)] = number(value, 0) or 0
        lines.append(line)
    found.text = "\n".join(lines) + "\n"
    found.modified = _modified(info.get("modificationdate", ""), info.get("modificationtime", ""))
    return found


def number(text: str, node: int, *, signed_bits: int = 0) -> int | None:
    """A number of a data sheet for this node-ID; None if it is none. `signed_bits`: of a signed type so wide."""
    total = 0
    for part in re.sub(r"\s", "", text).upper().split("+"):
        summand = node if part in ("$NODEID", "NODEID") else _whole(part)
        if summand is None:
            return None
        total += summand
    if signed_bits and total >= 1 << signed_bits - 1:
        total -= 1 << signed_bits
    return total


def _whole(text: str) -> int | None:
    text = _MINUS.sub("-0X", text)
    for base in (0, 10):  # 007 is a number in data sheets
        try:
            return int(text, base)
        except ValueError:
            continue
    return None


def _modified(date: str, time: str) -> tuple[int, int] | None:
    for form in _DATE_FORMATS:
        try:
            moment = datetime.strptime(f"{date} {time}".strip(), form).replace(tzinfo=UTC)
        except ValueError:
            continue
        since = moment - EPOCH
        return (since.days, since.seconds * 1000) if since.days >= 0 else None
    return None

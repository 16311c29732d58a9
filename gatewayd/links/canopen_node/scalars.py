"""The small languages of the CANopen part of a mapping: COB-IDs, timers, transmission types, members of PDOs.

As `gatewayd.mapping.scalars`: what cannot be read raises `ValueRefused` with the rule that it breaks.
"""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Final, Literal

from gatewayd.links.canopen_node.status_words import FIELD_NAMES
from gatewayd.mapping import syntax
from gatewayd.mapping.diagnostics import declare
from gatewayd.mapping.scalars import (
    OPTIONAL_DURATION_SCHEMA,
    one_or_many,
    optional_duration,
    refuse,
    scalar,
    span,
    written,
)
from gatewayd.mapping.typed import BeforeValidator, Field, InstanceOf

EVENT: Final = 254
"""Transmission type of `event`: manufacturer-specific, since the node has no device profile."""

BAD_COB_ID = declare(
    "GW121", "bad-cob-id", "a COB-ID that cannot be read", home="gatewayd.links.canopen_node.rules"
)

_COB_ID = re.compile(r"0x([0-9A-Fa-f]+)")
_MAX_COB_ID: Final = 0x7FF
_HEXADECIMAL = re.compile(r"0x[0-9A-Fa-f]{1,16}")
_DECIMAL = re.compile(r"0|[1-9][0-9]{0,15}")
_MAX_WORD32: Final = 0xFFFF_FFFF
_MEMBER = re.compile(
    r"(?P<name>[A-Za-z][A-Za-z0-9_]*)(?:\[(?P<first>[0-9]{1,4})(?:\.\.(?P<last>[0-9]{1,4}))?\])?"
)
_WHOLE = re.compile(r"0|[1-9][0-9]{0,8}")
_TRANSMISSIONS: Final = {"event": EVENT, "sync": 1}
_LAST_SYNCHRONOUS: Final = 240
_EVENT_DRIVEN: Final = (254, 255)
_MAX_RANGES: Final = 256
_MAX_MEMBERS: Final = 64
"""Entries of a PDO."""


def _timer(value: object, unit: float, ticks: str) -> float | None:
    """A duration that a 16-bit timer of `unit` seconds holds exactly, or None for `none`."""
    seconds = optional_duration(value)
    if seconds is None:
        return None
    count = seconds / unit
    if abs(count - round(count)) > 1e-6 * max(count, 1):
        refuse(
            syntax.BAD_DURATION,
            f"the duration `{written(value)}` is not a whole number of {ticks}",
            f"CANopen counts this time in {ticks}",
        )
    if count > 0xFFFF:
        greatest = 0xFFFF * unit
        refuse(
            syntax.OUT_OF_RANGE,
            f"the duration `{written(value)}` is longer than {greatest:.10g}s",
            f"CANopen counts this time in {ticks} with 16 bits: at most {greatest:.10g}s",
        )
    return round(count) * unit


_milliseconds = partial(_timer, unit=0.001, ticks="milliseconds")
_tenths = partial(_timer, unit=0.0001, ticks="tenths of a millisecond")

MillisecondTime = Annotated[
    float | None, BeforeValidator(_milliseconds, json_schema_input_type=OPTIONAL_DURATION_SCHEMA)
]
"""Seconds that a CANopen timer of 16-bit milliseconds holds, or `none`."""
InhibitTime = Annotated[
    float | None, BeforeValidator(_tenths, json_schema_input_type=OPTIONAL_DURATION_SCHEMA)
]
"""Seconds that a CANopen timer of 16-bit tenths of a millisecond holds, or `none`."""


def _cob_id(value: object) -> int:
    hint = "write an 11-bit identifier in hexadecimal digits, for example 0x1A0"
    text = scalar(value, "a COB-ID", hint)
    match = _COB_ID.fullmatch(text)
    if match is None:
        if text.isascii() and text.isdigit() and int(text) <= _MAX_COB_ID:
            hint = f"COB-IDs are hexadecimal here: 0x{int(text):03X}, or 0x{text} if {text} was meant so"
        refuse(BAD_COB_ID, f"`{text}` is not a COB-ID", hint)
    number = int(match[1], 16)
    if number > _MAX_COB_ID:
        refuse(syntax.OUT_OF_RANGE, f"the COB-ID {text} is greater than 0x7FF", hint)
    return number


def _word32(value: object, *words: str) -> int | str:
    """A number of 32 bits, decimal or hexadecimal, or one of the words."""
    hint = "write a number of 32 bits: 1, or 0x00010002"
    if words:
        hint += f", or {' or '.join(words)}"
    text = scalar(value, "a number of 32 bits", hint)
    if text in words:
        return text
    if _HEXADECIMAL.fullmatch(text):
        number = int(text, 16)
    elif _DECIMAL.fullmatch(text):
        number = int(text)
    else:
        refuse(syntax.BAD_NUMBER, f"`{text}` is not a number of 32 bits", hint)
    if number > _MAX_WORD32:
        refuse(syntax.OUT_OF_RANGE, f"{text} has more than 32 bits", hint)
    return number


_WORD32_SCHEMA = int | Annotated[str, Field(pattern="^0x[0-9A-Fa-f]{1,8}$", examples=["0x00010002"])]
Word32 = Annotated[int, BeforeValidator(_word32, json_schema_input_type=_WORD32_SCHEMA)]
"""A number of 32 bits."""
RevisionNumber = Annotated[
    int | Literal["auto"],
    BeforeValidator(
        lambda value: _word32(value, "auto"), json_schema_input_type=_WORD32_SCHEMA | Literal["auto"]
    ),
]
"""A number of 32 bits, or `auto`."""
SerialNumber = Annotated[
    int | Literal["fingerprint"],
    BeforeValidator(
        lambda value: _word32(value, "fingerprint"),
        json_schema_input_type=_WORD32_SCHEMA | Literal["fingerprint"],
    ),
]
"""A number of 32 bits, or `fingerprint`."""


def _cob_id_range(value: object) -> range:
    if isinstance(value, range):
        return value
    hint = "write a COB-ID (0x1A0) or a range of them (0x1A0..0x1AF)"
    first, dots, last = scalar(value, "a COB-ID", hint).partition("..")
    low = _cob_id(first)
    high = _cob_id(last) if dots else low
    if high < low:
        refuse(BAD_COB_ID, f"the range `{first}..{last}` runs backwards", f"write {last}..{first}")
    return range(low, high + 1)


_COB_ID_SCHEMA = int | Annotated[str, Field(pattern="^0x[0-9A-Fa-f]{1,3}$", examples=["0x1A0"])]
_COB_IDS_SCHEMA = (
    int
    | Annotated[
        str, Field(pattern=r"^0x[0-9A-Fa-f]{1,3}(\.\.0x[0-9A-Fa-f]{1,3})?$", examples=["0x1A0..0x1AF"])
    ]
)
CobId = Annotated[int, BeforeValidator(_cob_id, json_schema_input_type=_COB_ID_SCHEMA)]
"""An 11-bit identifier, written 0x and hexadecimal digits."""
CobIdRanges = Annotated[
    tuple[
        Annotated[InstanceOf[range], BeforeValidator(_cob_id_range, json_schema_input_type=_COB_IDS_SCHEMA)],
        ...,
    ],
    BeforeValidator(one_or_many, json_schema_input_type=_COB_IDS_SCHEMA | list[_COB_IDS_SCHEMA]),
    Field(max_length=_MAX_RANGES),
]
"""Identifiers and ranges of them, or a single one."""


def _transmission(value: object) -> int:
    hint = "write event, sync, or a transmission type of CiA 301: 0 to 240, 254, 255"
    text = scalar(value, "a transmission type", hint)
    if text in _TRANSMISSIONS:
        return _TRANSMISSIONS[text]
    if not _WHOLE.fullmatch(text):
        refuse(syntax.BAD_CHOICE, f"`{text}` is not a transmission type", hint)
    number = int(text)
    if not 0 <= number <= _LAST_SYNCHRONOUS and number not in _EVENT_DRIVEN:
        refuse(syntax.OUT_OF_RANGE, f"the transmission type {number} is reserved or on request only", hint)
    return number


Transmission = Annotated[
    int, BeforeValidator(_transmission, json_schema_input_type=Literal["event", "sync"] | int)
]
"""Transmission type: `event` is 254, `sync` is 1."""


@dataclass(frozen=True, slots=True)
class Member:
    """A variable, or some of a family, by name: `start`, `recipe[3]`, `recipe[0..7]`."""

    text: str
    name: str
    """Name of the line."""
    members: range | None = None
    """Members of the family; None: all that the line makes."""


def _member(value: object) -> Member:
    if isinstance(value, Member):
        return value
    hint = "write the name of a variable, `recipe[3]` or `recipe[0..7]` (in quotes inside a list in brackets)"
    text = scalar(value, "the name of a variable", hint)
    match = _MEMBER.fullmatch(text)
    if match is None:
        refuse(syntax.BAD_NAME, f"`{text}` does not name a variable", hint)
    return Member(text, match["name"], span(text, match, "first", "last"))


_MEMBER_SCHEMA = Annotated[
    str,
    Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*(\[[0-9]+(\.\.[0-9]+)?\])?$", examples=["start", "recipe[0..7]"]),
]
Members = Annotated[
    tuple[
        Annotated[InstanceOf[Member], BeforeValidator(_member, json_schema_input_type=_MEMBER_SCHEMA)], ...
    ],
    BeforeValidator(one_or_many, json_schema_input_type=_MEMBER_SCHEMA | list[_MEMBER_SCHEMA]),
    Field(max_length=_MAX_MEMBERS),
]
"""Variables by name, or a single one."""


@dataclass(frozen=True, slots=True)
class StatusMember:
    """Words of the status block: a field (`flags`), or the quality of variables (`quality of recipe[0..3]`)."""

    text: str
    field: str
    """Name of the field; empty for qualities."""
    variables: Member | None = None
    """The variables whose quality is meant."""


_QUALITY_OF: Final = "quality of "


def _status_member(value: object) -> StatusMember:
    if isinstance(value, StatusMember):
        return value
    hint = "write a field of the status block such as flags or robot_state, or `quality of` and a variable"
    text = scalar(value, "a word of the status block", hint)
    if text.startswith(_QUALITY_OF):
        return StatusMember(text, "", _member(text.removeprefix(_QUALITY_OF).strip()))
    if text not in FIELD_NAMES:
        close = difflib.get_close_matches(text, FIELD_NAMES, n=1, cutoff=0.6)
        hint = f"did you mean `{close[0]}`?" if close else hint
        refuse(syntax.BAD_CHOICE, f"`{text}` is not a word of the status block that a PDO can carry", hint)
    return StatusMember(text, text)


_STATUS_SCHEMA = (
    Annotated[str, Field(json_schema_extra={"enum": [*FIELD_NAMES]})]
    | Annotated[
        str,
        Field(
            pattern=r"^quality of +[A-Za-z][A-Za-z0-9_]*(\[[0-9]+(\.\.[0-9]+)?\])?$",
            examples=["quality of force"],
        ),
    ]
)
StatusMembers = Annotated[
    tuple[
        Annotated[
            InstanceOf[StatusMember], BeforeValidator(_status_member, json_schema_input_type=_STATUS_SCHEMA)
        ],
        ...,
    ],
    BeforeValidator(one_or_many, json_schema_input_type=_STATUS_SCHEMA | list[_STATUS_SCHEMA]),
    Field(max_length=_MAX_MEMBERS),
]
"""Words of the status block by name, or a single one."""

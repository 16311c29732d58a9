"""The small languages of the robot's part of a mapping: references to its fields, software versions.

As `gatewayd.mapping.scalars`: what cannot be read raises `ValueRefused` with the rule that it breaks.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated

from gatewayd.mapping import syntax
from gatewayd.mapping.diagnostics import declare
from gatewayd.mapping.scalars import refuse, scalar, span
from gatewayd.mapping.typed import BeforeValidator, Field, InstanceOf

BAD_REFERENCE = declare(
    "GW117",
    "bad-robot-reference",
    "a `robot:` reference that cannot be read",
    home="gatewayd.links.robot.rules",
)
_REFERENCE = re.compile(
    r"(?P<field>[A-Za-z][A-Za-z0-9_]*?)"
    r"(?:(?P<first>[0-9]{1,4})\.\.(?P<last>[0-9]{1,4})"
    r"|(?P<element>\[(?P<element_first>[0-9]{1,4})(?:\.\.(?P<element_last>[0-9]{1,4}))?\])?"
    r"(?:\.(?P<bit_first>[0-9]{1,4})(?:\.\.(?P<bit_last>[0-9]{1,4}))?)?)"
)
_VERSION = re.compile(r"([0-9]{1,4})(?:\.([0-9]{1,4}))?(?:\.([0-9]{1,9}))?(?:\.[0-9]{1,9})?")


def _version(value: object) -> tuple[int, int, int]:
    hint = "write the controller software as PolyScope shows it, for example 5.12 or 10.7.0"
    if isinstance(value, tuple):
        return value
    text = scalar(value, "a version", hint)
    match = _VERSION.fullmatch(text)
    if match is None:
        refuse(syntax.BAD_NUMBER, f"`{text}` is not a version", hint)
    return int(match[1]), int(match[2] or 0), int(match[3] or 0)


Version = Annotated[
    tuple[int, int, int],
    BeforeValidator(
        _version,
        json_schema_input_type=float
        | Annotated[str, Field(pattern=r"^[0-9]+(\.[0-9]+){0,3}$", examples=["5.12.0"])],
    ),
]
"""Version of the controller software: major, minor, bugfix."""


@dataclass(frozen=True, slots=True)
class Reference:
    """What a `robot:` key names: a field, elements of a vector, bits of an integer, or numbered registers."""

    text: str
    field: str
    """Name of the field; for numbered registers without the number (`output_int_register_`)."""
    registers: range | None = None
    """Numbers of the registers; None when the field is named in full."""
    elements: range | None = None
    """Elements of a vector field."""
    bits: range | None = None
    """Bits of an integer field."""
    many: bool = False
    """Written as a range, so that it makes a numbered family of variables even where it holds one."""

    def __str__(self) -> str:
        """As written."""
        return self.text


def _reference(value: object) -> Reference:
    if isinstance(value, Reference):
        return value
    hint = (
        "write a field (actual_TCP_pose), 'field[0]', field.3, or a range such as output_int_register_0..23"
    )
    text = scalar(value, "the name of an RTDE field", hint)
    match = _REFERENCE.fullmatch(text)
    if match is None:
        refuse(BAD_REFERENCE, f"`{text}` does not name an RTDE field", hint)
    registers = span(text, match, "first", "last")
    elements = span(text, match, "element_first", "element_last")
    bits = span(text, match, "bit_first", "bit_last")
    ranges = sum(match[key] is not None for key in ("last", "element_last", "bit_last"))
    if ranges > 1:
        refuse(BAD_REFERENCE, f"`{text}` holds more than one range", hint)
    return Reference(text, match["field"], registers, elements, bits, many=ranges > 0)


RobotReference = Annotated[
    InstanceOf[Reference],
    BeforeValidator(
        _reference,
        json_schema_input_type=Annotated[
            str,
            Field(
                pattern=r"^[A-Za-z][A-Za-z0-9_]*([0-9]\.\.[0-9]+)?(\[[0-9]+(\.\.[0-9]+)?\])?(\.[0-9]+(\.\.[0-9]+)?)?$",
                examples=["input_bit_register_0", "output_double_register_0..23", "actual_TCP_pose[0]"],
            ),
        ],
    ),
]
"""A field of the robot, or a part of it."""

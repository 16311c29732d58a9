"""L5X: one data type or one routine to a file, as public generators write it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final
from xml.sax.saxutils import quoteattr

_BITS: Final = 8
"""Truths of a data type lie in hidden numbers of so many bits."""
_ARRAY_BITS: Final = 32
"""An array of truths has a multiple of so many."""


@dataclass(frozen=True, slots=True)
class LogixMember:
    """A member of a data type, or a tag."""

    name: str
    type: str
    count: int = 0
    """Elements; 0: no array."""
    comment: str = ""

    @property
    def dimension(self) -> int:
        """Elements as the controller has them."""
        return -(-self.count // _ARRAY_BITS) * _ARRAY_BITS if self.type == "BOOL" else self.count


def data_type(name: str, comment: str, members: Sequence[LogixMember]) -> str:
    """A file with one data type."""
    inner = [
        f'<DataTypes Use="Context">\n<DataType Use="Target" Name="{name}" Family="NoFamily" Class="User">',
        f"<Description>{_cdata(comment)}</Description>",
        "<Members>",
        *_members(name, members),
        "</Members>\n</DataType>\n</DataTypes>",
    ]
    return _content(name, "DataType", inner)


def routine(name: str, program: str, lines: Sequence[str], comment: str) -> str:
    """A file with one routine of structured text."""
    numbered = [f'<Line Number="{number}">{_cdata(line)}</Line>' for number, line in enumerate(lines)]
    inner = [
        f'<Programs Use="Context">\n<Program Use="Context" Name="{program}">\n<Routines Use="Context">',
        f'<Routine Use="Target" Name="{name}" Type="ST">',
        f"<Description>{_cdata(comment)}</Description>",
        "<STContent>",
        *numbered,
        "</STContent>\n</Routine>\n</Routines>\n</Program>\n</Programs>",
    ]
    return _content(name, "Routine", inner, ' TargetSubType="ST"')


def _content(name: str, kind: str, inner: Sequence[str], more: str = "") -> str:
    target = f'TargetName="{name}" TargetType="{kind}"{more}'
    lines = [
        '<?xml version="1.0" encoding="UTF-8" standalone="yes"?>',
        f'<RSLogix5000Content SchemaRevision="1.0" SoftwareRevision="32.00" {target} ContainsContext="true">',
        '<Controller Use="Context" Name="Controller">',
        *inner,
        "</Controller>\n</RSLogix5000Content>",
    ]
    return "\n".join(lines) + "\n"


def _members(name: str, members: Sequence[LogixMember]) -> Iterator[str]:
    """Single truths are bits of hidden numbers, eight to each, in the order of the members."""
    bits = [member.name for member in members if member.type == "BOOL" and not member.count]
    place = {bit: (f"ZZZZZZZZZZ{name}{index // _BITS}", index % _BITS) for index, bit in enumerate(bits)}
    for member in members:
        if member.name not in place:
            yield from _member(member.name, member.type, member.dimension, member.comment)
            continue
        host, bit = place[member.name]
        if bit == 0:
            yield from _member(host, "SINT", 0, "", hidden=True)
        yield from _member(member.name, "BIT", 0, member.comment, f' Target="{host}" BitNumber="{bit}"')


def _member(
    name: str, kind: str, dimension: int, comment: str, more: str = "", *, hidden: bool = False
) -> Iterator[str]:
    radix = {"REAL": "Float", "LREAL": "Float"}.get(kind, "Decimal")
    shown = "true" if hidden else "false"
    yield (
        f'<Member Name={quoteattr(name)} DataType="{kind}" Dimension="{dimension}" Radix="{radix}" '
        f'Hidden="{shown}"{more} ExternalAccess="Read/Write">'
    )
    if comment:
        yield f"<Description>{_cdata(comment)}</Description>"
    yield "</Member>"


def _cdata(text: str) -> str:
    return f"<![CDATA[{text.replace(']]>', ']] >')}]]>"

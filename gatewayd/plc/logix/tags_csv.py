"""The table of tags that Studio 5000 imports: it makes tags, and gives them no values."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from gatewayd.plc.logix.l5x import LogixMember


def tags(remarks: Sequence[str], members: Iterable[LogixMember]) -> str:
    """Controller tags."""
    lines = ['remark,"CSV-Import-Export"']
    lines += [f"remark,{_text(remark)}" for remark in remarks]
    lines += ["0.3", "TYPE,SCOPE,NAME,DESCRIPTION,DATATYPE,SPECIFIER,ATTRIBUTES"]
    for member in members:
        kind = f"{member.type}[{member.dimension}]" if member.count else member.type
        attributes = "(Constant := false, ExternalAccess := Read/Write)"
        lines.append(f'TAG,,{member.name},{_text(member.comment)},"{kind}","",{_text(attributes)}')
    return "\n".join(lines) + "\n"


def _text(text: str) -> str:
    """A text in quotation marks, with the escapes of the format."""
    return '"' + "".join(map(_character, text)) + '"'


def _character(character: str) -> str:
    known = {'"': "$Q", "$": "$$", "\n": "$N"}.get(character)
    if known is not None:
        return known
    if " " <= character <= "~":
        return character
    units = character.encode("utf-16-be", "surrogatepass")
    return "".join(f"${units[at]:02X}{units[at + 1]:02X}" for at in range(0, len(units), 2))

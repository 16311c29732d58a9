"""Objects of TwinCAT's project tree, one file each. Identifiers are made from the names, so that they stay."""

from __future__ import annotations

from collections.abc import Sequence
from uuid import NAMESPACE_URL, uuid5

from gatewayd.links.exports import ExportedFile
from gatewayd.plc.model import CellModel
from gatewayd.plc.st.program import ProgramUnit
from gatewayd.plc.st.source import comment, declaration


def lines_with(head: Sequence[str], lines: Sequence[str]) -> list[str]:
    """Lines below a header of comments."""
    return [*map(comment, head), *lines]


def unit_file(
    model: CellModel, unit: ProgramUnit, head: Sequence[str], *, once: bool = False
) -> ExportedFile:
    """The file of a function, a block or a program."""
    body = f"    <Implementation>\n      <ST>{_cdata(unit.body)}</ST>\n    </Implementation>"
    text = object_text(model, "POU", unit.name, lines_with(head, declaration(unit)), body)
    return ExportedFile(f"{unit.name}.TcPOU", text, line_end="\r\n", once=once)


def object_text(model: CellModel, element: str, name: str, declared: Sequence[str], body: str = "") -> str:
    """An object of the project tree: `DUT`, `POU` or `GVL`."""
    identifier = uuid5(NAMESPACE_URL, f"gatewayd/{model.cell}/{name}")
    special = ' SpecialFunc="None"' if element == "POU" else ""
    lines = (
        '<?xml version="1.0" encoding="utf-8"?>',
        '<TcPlcObject Version="1.1.0.1" ProductVersion="3.1.4024.0">',
        f'  <{element} Name="{name}" Id="{{{identifier}}}"{special}>',
        f"    <Declaration>{_cdata(declared)}</Declaration>",
        *([body] if body else []),
        f"  </{element}>",
        "</TcPlcObject>",
    )
    return "\n".join(lines) + "\n"


def _cdata(lines: Sequence[str]) -> str:
    text = "\n".join(lines).replace("]]>", "]] >")
    return f"<![CDATA[{text}\n]]>"

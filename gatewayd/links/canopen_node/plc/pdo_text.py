"""The PDOs as tables for people: what is typed into, or compared with, the dialogs of a master's configurator."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from gatewayd.links.canopen_node.plc.model import PdoImage, PdoModel, PdoTag, PdoWord
from gatewayd.plc.numbers import NUMBERS


def pdo_lines(model: PdoModel) -> tuple[str, ...]:
    """The node and its PDOs, one line each."""
    lines = [
        f"CANopen node {model.node}, {model.bitrate} bit/s; the objects are those of gatewayd export eds"
    ]
    lines += [about(pdo) for pdo in model.pdos]
    return tuple(lines)


def about(pdo: PdoImage) -> str:
    """`tpdo1: COB-ID 190h, 8 bytes, event-driven`."""
    return f"{pdo.name}: COB-ID {pdo.cob_id:03X}h, {pdo.size} byte{'s' if pdo.size > 1 else ''}, {pdo.how}"


def object_table(model: PdoModel, variable: Callable[[PdoImage, PdoTag | PdoWord], str]) -> Iterator[str]:
    """All objects of all PDOs; `variable` names what each is mapped to."""
    rows: list[tuple[str, ...]] = [("PDO", "COB-ID", "Object", "Bits", "First bit", "Variable", "Meaning")]
    for pdo in model.pdos:
        rows += [_row(pdo, entry, variable(pdo, entry)) for entry in pdo.entries]
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    for row in rows:
        yield "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()


def _row(pdo: PdoImage, entry: PdoTag | PdoWord, variable: str) -> tuple[str, ...]:
    return (
        pdo.name,
        f"{pdo.cob_id:03X}h",
        f"{entry.index:04X}h:{entry.subindex:02X}",
        str(_bits(entry)),
        str(entry.start),
        variable,
        entry.name if isinstance(entry, PdoTag) else entry.about,
    )


def _bits(entry: PdoTag | PdoWord) -> int:
    if isinstance(entry, PdoWord):
        return 16 * entry.words
    return 1 if entry.encoding is None else 8 * NUMBERS[entry.encoding.type].size

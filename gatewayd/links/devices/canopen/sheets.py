"""Data sheets that a mapping names: files beside it, read once however often they are asked for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final

from gatewayd.canopen.manager.data_sheet import DataSheet, DataSheetError
from gatewayd.mapping.document import Document

MAX_SHEET: Final = 4 << 20
"""Bytes of a data sheet; the longest ones that vendors have are a tenth of it."""


@dataclass(frozen=True, slots=True)
class SheetFile:
    """What a data sheet says, or why it says nothing."""

    path: str
    sheet: DataSheet | None = None
    problem: str = ""


def sheet_of(document: Document, eds: str, node: int) -> SheetFile:
    """The data sheet that a mapping names, for a node-ID. Never raises."""
    path = Path(document.source.name).parent / eds
    try:
        with path.open("rb") as file:
            data = file.read(MAX_SHEET + 1)
    except OSError as error:
        return SheetFile(str(path), problem=error.strerror or str(error))
    except ValueError as error:  # a path that no file system has
        return SheetFile(str(path), problem=str(error))
    if len(data) > MAX_SHEET:
        return SheetFile(str(path), problem=f"it has more than {MAX_SHEET} bytes")
    return _read(str(path), data, node)


@lru_cache(maxsize=64)
def _read(path: str, data: bytes, node: int) -> SheetFile:
    try:
        return SheetFile(path, DataSheet(data, node))
    except DataSheetError as error:
        return SheetFile(path, problem=str(error))

"""The status block as objects: the same numbers that Modbus shows from 60000 on, and the same requests for locks.

Indices are fixed, like the block's addresses: a record of the header's fields, then one array for each table, with 254
entries to an index. Entry n of a table of variables is variable n; variable 255 is entry 1 of the next index.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Final

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import Abort, Access, Entry, Object, Pdo, array, record
from gatewayd.core.cell import Cell
from gatewayd.core.requester import Requester
from gatewayd.core.status import StatusBlock
from gatewayd.core.status_layout import RELEASE, REQUEST, TABLES, StatusTable
from gatewayd.links.canopen_node.pdo.codec import Mapped
from gatewayd.links.canopen_node.status_words import HEADER, MAX_ARRAY, TABLE_INDICES, WORD_TYPES
from gatewayd.links.canopen_node.variables import ABORT_OF
from gatewayd.links.registry import status_fields


def status_word(index: int, subindex: int) -> Mapped | None:
    """What a TPDO carries of the status block there; None if it may carry nothing.

    Whether a table has so many entries, the dictionary knows.
    """
    if index == HEADER:
        fields = status_fields()
        field = fields[subindex - 1] if 0 < subindex <= len(fields) else None
        if field is None or field.offset in (REQUEST, RELEASE):
            return None
        return Mapped(None, WORD_TYPES[field.words], field.offset)
    for table in TABLES:
        chunk = index - TABLE_INDICES[table.name]
        if subindex and 0 <= chunk < -(-table.words // MAX_ARRAY):
            return Mapped(None, CanType.UNSIGNED16, table.offset + chunk * MAX_ARRAY + subindex - 1)
    return None


_LAYOUT: Final = 0
"""Where the version of the layout is: the only word that never changes."""


class StatusObjects:
    """The objects of one cell's status block."""

    def __init__(
        self,
        cell: Cell,
        clock: Callable[[], float],
        requester: Callable[[], Requester],
        asking: Callable[[], Requester],
    ) -> None:
        """`clock`: the moment of the request that is being served; `requester`: who SDO clients are now.

        `asking`: the same, when one asks for a lock.
        """
        self._block = StatusBlock(cell, status_fields())
        self._definition = cell.definition
        self._clock = clock
        self._requester = requester
        self._asking = asking

    def objects(self) -> Iterator[Object]:
        """5F00h and the tables that have entries."""
        fields = enumerate(status_fields(), 1)
        entries = (self._entry(number, field.name, field.offset, field.words) for number, field in fields)
        yield record(HEADER, "Status", entries)
        for table in TABLES:
            names = self._names(table)
            for chunk, start in enumerate(range(0, len(names), MAX_ARRAY)):
                title = f"Status {table.name}" + (f" {chunk + 1}" if chunk else "")
                entries = (
                    self._entry(number, f"{table.name} {name}", table.offset + start + number - 1, 1)
                    for number, name in enumerate(names[start : start + MAX_ARRAY], 1)
                )
                yield array(TABLE_INDICES[table.name] + chunk, title, entries)

    def _entry(self, subindex: int, name: str, offset: int, words: int) -> Entry:
        writable = offset in (REQUEST, RELEASE)
        if offset == _LAYOUT:
            constant = self._read(offset, words)
            return Entry(subindex, name, WORD_TYPES[words], Access.CONST, constant, pdo=Pdo.TRANSMIT)
        return Entry(
            subindex,
            name,
            WORD_TYPES[words],
            Access.RW if writable else Access.RO,
            bytes(2 * words),
            pdo=Pdo.NONE if writable else Pdo.TRANSMIT,
            source=partial(self._read, offset, words),
            sink=partial(self._write, offset) if writable else None,
        )

    def _names(self, table: StatusTable) -> Sequence[str]:
        """What each entry of the table stands for."""
        variables = [variable.name for variable in self._definition.variables]
        if table.name == "writers_alive":
            return [writer.name for writer in self._definition.writers]
        if table.name == "good":
            words = (variables[first : first + 16] for first in range(0, len(variables), 16))
            return [f"{word[0]}..{word[-1]}" for word in words]
        return variables

    def _read(self, offset: int, words: int) -> bytes:
        # The block has its high word first and its high byte first, so that all bytes are reversed.
        return self._block.read(offset, words, self._clock())[::-1]

    def _write(self, offset: int, data: bytes) -> None:
        word = int.from_bytes(data, "little")
        requester = self._asking() if offset == REQUEST and word else self._requester()
        refusal = self._block.write(requester, offset, (word,), self._clock())
        if refusal is not None:
            raise Abort(ABORT_OF[refusal.reason], recorded=True)

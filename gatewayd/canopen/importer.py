"""What another implementation makes of our data sheets: python-canopen's importer (CiA 306), read entry by entry."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from io import StringIO

import canopen
from canopen.objectdictionary import ODVariable

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import Entry, Object, ObjectCode, Pdo


class _Sheet(StringIO):
    """An open file: the importer looks at the name."""

    name = "cell.eds"


def differences(text: str, objects: Iterable[Object], node: int) -> tuple[str, ...]:
    """Where the importer, given the node-ID, reads another name, type, access, PDO flag or default than was meant.

    Empty for a good sheet. Raises what the importer raises on a text that is no EDS.
    """
    imported = canopen.import_od(_Sheet(text), node_id=node)
    return tuple(
        f"{item.index:04X}h sub {entry.subindex}: {problem}"
        for item in objects
        for entry in item.entries
        for problem in _differs(_found(imported, item, entry), entry)
    )


def _found(imported: canopen.ObjectDictionary, item: Object, entry: Entry) -> ODVariable | None:
    found = imported.get(item.index)
    if found is None or isinstance(found, ODVariable) == (item.code is not ObjectCode.VAR):
        return None
    if isinstance(found, ODVariable):
        return found
    part = found.subindices.get(entry.subindex)
    return part if isinstance(part, ODVariable) else None


def _differs(found: ODVariable | None, entry: Entry) -> Iterator[str]:
    if found is None:
        yield "missing"
        return
    for what, read, meant in (
        ("name", found.name, entry.name),
        ("type", found.data_type, entry.type.code),
        ("access", found.access_type, entry.access.value),
        ("PDO mapping", found.pdo_mappable, entry.pdo is not Pdo.NONE),
        ("default", found.default, _default(entry)),
    ):
        if read != meant:
            yield f"{what} {meant!r} is read as {read!r}"


def _default(entry: Entry) -> str | float | None:
    if entry.is_volatile:
        return None
    is_text = entry.type is CanType.VISIBLE_STRING
    return entry.default.decode() if is_text else entry.type.unpack(entry.default)

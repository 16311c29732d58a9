"""The kinds of links that there are. A new one is a package beside these and a line in `LINK_KINDS`."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, cast

from gatewayd.core.status_layout import FIELDS, LinkTable, StatusField
from gatewayd.links.contract import LinkKind, LinkRuntime, TrafficDecoder

if TYPE_CHECKING:
    from gatewayd.links.access import DeviceAccess
    from gatewayd.links.examination import Examination
    from gatewayd.links.exports import Export, ExportSet
    from gatewayd.links.language import DefiningLanguage, LinkLanguage
    from gatewayd.links.proposals import SheetReader
    from gatewayd.links.tables import LinkTables

LINK_KINDS = (
    "gatewayd.links.robot",
    "gatewayd.links.robot.dashboard",
    "gatewayd.links.modbus_server",
    "gatewayd.links.canopen_node",
    "gatewayd.links.devices",
    "gatewayd.links.mqtt",
    "gatewayd.links.standby",
)
"""Packages, imported when they are used. Their order is that of sections in lists and tables."""


@cache
def kinds() -> tuple[LinkKind, ...]:
    """All kinds, in order."""
    return tuple(map(_kind_in, LINK_KINDS))


def _kind_in(package: str) -> LinkKind:
    kind = import_module(f"{package}.declaration").KIND
    if not isinstance(kind, LinkKind):
        raise TypeError(f"{package}.declaration.KIND is no LinkKind")
    return kind


@cache
def status_fields() -> tuple[StatusField, ...]:
    """All numbers of the status block's header, the core's and those of all kinds, by address."""
    fields = (*FIELDS, *(field for kind in kinds() for field in kind.status_fields))
    return tuple(sorted(fields, key=lambda field: field.offset))


@cache
def status_tables() -> tuple[LinkTable, ...]:
    """All tables of the status block that links report, by address."""
    tables = (table for kind in kinds() for table in kind.status_tables)
    return tuple(sorted(tables, key=lambda table: table.offset))


def kind_of(key: str) -> LinkKind:
    """The kind whose links have this key."""
    return next(kind for kind in kinds() if kind.key == key)


@cache
def language_of(key: str) -> LinkLanguage:
    """What the kind with this key adds to the mapping language."""
    # The daemon, which has no use for models, imports this module and not those.
    language: LinkLanguage = import_module(f"{_package(key)}.language").LANGUAGE
    return language


@cache
def languages() -> tuple[LinkLanguage, ...]:
    """What all kinds add to the mapping language, in order."""
    return tuple(language_of(kind.key) for kind in kinds())


@cache
def definer() -> DefiningLanguage:
    """What the one kind that defines variables adds to the mapping language."""
    (found,) = (language for language in languages() if language.defines)
    return cast("DefiningLanguage", found)


@cache
def tables() -> tuple[LinkTables, ...]:
    """What all kinds show of a mapping, in order."""
    return tuple(import_module(language.tables).TABLES for language in languages() if language.tables)


@cache
def exports() -> Mapping[str, Export | ExportSet]:
    """What all kinds write for other tools, by name; what several write is one, with a way for each of them."""
    found: dict[str, Export | ExportSet] = {}
    for kind in kinds():
        for export in import_module(kind.exports).EXPORTS if kind.exports else ():
            known = found.get(export.name)
            found[export.name] = export if known is None else known.joined(export)
    return found


def decoder_of(key: str) -> TrafficDecoder:
    """What puts the traffic of links with this key into words; a new one, which remembers nothing yet."""
    module = kind_of(key).traffic
    found = import_module(module).DECODER() if module else TrafficDecoder()
    assert isinstance(found, TrafficDecoder)
    return found


def examination_of(key: str) -> Examination | None:
    """What looks at what links with this key need; None: nothing does."""
    # Commands that look at nothing import this module, too.
    module = kind_of(key).doctor
    found: Examination | None = import_module(module).EXAMINATION if module else None
    return found


def access_of(key: str) -> DeviceAccess | None:
    """What talks to devices of links with this key where no gateway does; None: it has no devices."""
    module = kind_of(key).access
    found: DeviceAccess | None = import_module(module).ACCESS if module else None
    return found


def sheet_readers() -> tuple[SheetReader, ...]:
    """What proposes mappings from data sheets, of all kinds that do."""
    return tuple(import_module(kind.sheets).SHEETS for kind in kinds() if kind.sheets)


@cache
def runtime_of(key: str) -> LinkRuntime:
    """What makes links of the kind with this key."""
    runtime = import_module(f"{_package(key)}.runtime").RUNTIME
    assert isinstance(runtime, LinkRuntime)
    return runtime


def _package(key: str) -> str:
    return next(package for package, kind in zip(LINK_KINDS, kinds(), strict=True) if kind.key == key)

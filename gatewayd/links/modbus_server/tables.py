"""What the Modbus server's kind shows of a mapping: where variables lie in its areas."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from gatewayd.links.modbus_places.located import part_text
from gatewayd.links.modbus_places.placing import ExpandedPlacement
from gatewayd.links.modbus_server.declaration import KIND
from gatewayd.links.modbus_server.description import beside
from gatewayd.links.modbus_server.expand import placements_of
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.links.tables import LinkTables
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.plan import Plan
from gatewayd.modbus.areas import AREA_NAMES
from gatewayd.modbus.codec import turns
from gatewayd.report.format import address as address_text
from gatewayd.report.layout import Column, Row, span


class ModbusTables(LinkTables):
    """A row for each place of a variable."""

    key = KIND.key
    columns = (
        Column("area", "unit"),
        Column("address", "unit", None),
        Column("bit", "unit", None),
        Column("notation", "unit"),
        Column("words", "unit", 0),
        Column("type", "unit"),
        Column("order", "unit"),
        Column("scale", "unit", None),
        Column("offset", "unit", None),
    )
    screen = (Column("address", "value"), Column("4xxxxx", "value"), Column("type", "value"))
    page = (
        Column("area", "value"),
        Column("address from 0", "value"),
        Column("4xxxxx", "value"),
        Column("type", "value"),
    )
    notes = ("status of the gateway: holding and input registers from 60000 (460001, 360001)",)

    def rows(self, cell: ExpandedCell) -> Mapping[int, Sequence[Mapping[str, object]]]:
        """Area, address from 0 with its bit, the same in 4xxxxx form, registers covered, and how numbers are written.

        Bits have no byte order, scale and offset; numbers in one register have an order where their bytes are swapped.
        """
        found: dict[int, list[Mapping[str, object]]] = {}
        for placement in placements_of(cell):
            found.setdefault(placement.variable.index, []).append(_row(placement))
        return found

    def on_screen(self, first: Row, last: Row) -> Mapping[str, str]:
        """`holding 100-147`."""
        type_name = first["type"] if first["order"] in ("", "ABCD") else f"{first['type']} {first['order']}"
        place = f"{first['area']} {_addresses(first, last)}".strip()
        return {"address": place, "4xxxxx": _notations(first, last), "type": type_name}

    def on_page(self, row: Row) -> Mapping[str, str]:
        """The place in both ways of counting."""
        address = row["address"]
        return {
            "area": row["area"],
            "address from 0": "" if address is None else f"{address}{_part(row)}",
            "4xxxxx": row["notation"],
            "type": f"{row['type']} {row['order']}".strip(),
        }

    def conversion(self, row: Row) -> str:
        """Scale and offset."""
        scale, offset = row["scale"], row["offset"]
        text = "" if scale in (None, 1) else f"raw * {scale:.10g}"
        if offset:
            text = f"{text or 'raw'} {'+' if offset > 0 else '-'} {abs(offset):.10g}"
        return text

    def headline(self, plan: Plan) -> str:
        """Listener and unit."""
        modbus = plan.the(ModbusPlan)
        return f"Modbus TCP {address_text(modbus.host, modbus.port)}{beside(modbus)} unit {modbus.unit}"

    def introduction(self, plan: Plan) -> str:
        """Port and unit."""
        modbus = plan.the(ModbusPlan)
        return f"Modbus TCP, port {modbus.port}, unit {modbus.unit}."

    def document(self, plan: Plan, cell: ExpandedCell) -> object:
        """Listener and unit."""
        modbus = plan.the(ModbusPlan)
        return {"host": modbus.host, "port": modbus.port, "unit": modbus.unit}


def _row(placement: ExpandedPlacement) -> Mapping[str, object]:
    is_number = placement.codec is not None
    return {
        "area": AREA_NAMES[placement.area],
        "address": placement.address,
        "bit": placement.bit,
        "notation": placement.notation,
        "words": placement.words,
        "type": placement.type,
        "order": placement.order if is_number and turns(placement.order, placement.type) else "",
        "scale": placement.scale if is_number else None,
        "offset": placement.offset if is_number else None,
    }


def _part(row: Row) -> str:
    return part_text(row["bit"], is_byte=row["type"] != "bit")


def _addresses(first: Row, last: Row) -> str:
    """Protocol addresses covered: `100-147`, `0.0-3.15`."""
    if first["address"] is None or last["address"] is None:
        return ""
    if first["bit"] is not None:
        return span(f"{first['address']}{_part(first)}", f"{last['address']}{_part(last)}")
    return span(str(first["address"]), str(last["address"] + last["words"] - 1))


def _notations(first: Row, last: Row) -> str:
    """The same in 4xxxxx form; of bits in several registers the registers."""
    if not first["notation"] or (first["notation"] == last["notation"] and first["bit"] is not None):
        return str(first["notation"])
    begin, end = (row["notation"].partition(".")[0] for row in (first, last))
    return span(begin, f"{int(end) + last['words'] - 1:06d}")


TABLES: Final = ModbusTables()

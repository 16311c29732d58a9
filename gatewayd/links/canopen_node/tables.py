"""What the CANopen node's kind shows of a mapping: objects and PDOs, and the load of the bus."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from gatewayd.core.definition import Direction
from gatewayd.links.canopen_node.declaration import KIND
from gatewayd.links.canopen_node.expand import node_of
from gatewayd.links.canopen_node.pdo_table import (
    PdoItem,
    PdoRow,
    as_document,
    by_sdo_only,
    load_by_bit_rate,
    object_place,
    pdo_rows,
    transmission_words,
)
from gatewayd.links.canopen_node.plan import CanopenPlan
from gatewayd.links.tables import LinkTables
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.plan import Plan
from gatewayd.report.layout import Column, ReportTable, Row, Text, span
from gatewayd.report.wording import cob, seconds


class CanopenTables(LinkTables):
    """The object of each variable, and the table of the PDOs."""

    key = KIND.key
    columns = (
        Column("object", "whole"),
        Column("can_type", "whole"),
        Column("pdo", "whole"),
        Column("cob_id", "whole"),
        Column("pdo_bit", "whole", None),
    )
    screen = (Column("address", "value"), Column("type", "value"))
    page = ()
    notes = ("status of the gateway: objects from 5F00h",)

    def rows(self, cell: ExpandedCell) -> Mapping[int, Sequence[Mapping[str, object]]]:
        """The object with its type, and the PDO that carries it with COB-ID and first bit."""
        node = node_of(cell)
        if node is None:
            return {}
        empty = {column.name: column.empty for column in self.columns}
        found: dict[int, dict[str, object]] = {
            placed.variable: {
                **empty,
                "object": object_place(placed.plan.index, placed.plan.subindex),
                "can_type": placed.plan.type_text,
            }
            for placed in node.objects
        }
        for pdo in node.pdos:
            assert pdo.slot.cob_id is not None
            for bit, placed in pdo.offsets:
                found[placed.variable] |= {"pdo": pdo.label, "cob_id": cob(pdo.slot.cob_id), "pdo_bit": bit}
        return {index: [row] for index, row in found.items()}

    def on_screen(self, first: Row, last: Row) -> Mapping[str, str]:
        """The object, where nothing else has the variable."""
        if not first["object"]:
            return {}
        return {"address": f"object {_objects(first['object'], last['object'])}", "type": first["can_type"]}

    def headline(self, plan: Plan) -> str:
        """Bus and node-ID."""
        node = plan.the(CanopenPlan)
        return f"CANopen {node.channel} node {node.node}"

    def screen_table(self, cell: ExpandedCell) -> ReportTable:
        """The PDOs in short, what no PDO carries, and the share of the bus in the worst case for each bit-rate."""
        head = ("PDO", "COB-ID", "transmission", "inhibit", "event", "bits", "variables", "object", "type")
        objects = by_sdo_only(cell)
        return ReportTable(
            head,
            list(_screen_rows(cell)),
            notes=(
                *([f"by SDO only: {', '.join(objects)}"] if objects else ()),
                f"worst-case bus load by bit-rate: {', '.join(reversed(_shares(cell)))}",
            ),
        )

    def page_table(self, cell: ExpandedCell) -> ReportTable | None:
        """The PDOs in full, and the load of the bus."""
        node = node_of(cell)
        if node is None:
            return None
        spec = node.part.spec
        event = "event or deadline"
        head = ("PDO", "COB-ID", "transmission", "inhibit", event, "bit", "variable", "object", "type")
        rows = [
            (row.pdo, row.cob_id, transmission_words(row.transmission), _time(row.inhibit), _time(row.event),
             str(item.bit), name, item.object, item.type)
            for row in pdo_rows(cell)
            for name, item in _items(row)
        ]  # fmt: skip
        return ReportTable(
            head,
            rows,
            f"PDOs of node {spec.node} on {spec.channel} ({spec.bitrate} bit/s)",
            (f"Worst-case load of the bus by bit-rate: {', '.join(_shares(cell))}.",),
        )

    def document(self, plan: Plan, cell: ExpandedCell) -> object:
        """The PDO table and the load of the bus by bit-rate."""
        return as_document(cell)


def _screen_rows(cell: ExpandedCell) -> Iterator[Sequence[Text]]:
    for row in pdo_rows(cell):
        receives = row.direction is Direction.INPUT
        own: tuple[Text, ...] = (
            (row.pdo, "bold"),
            row.cob_id,
            transmission_words(row.transmission),
            _time(row.inhibit),
            _time(row.event),
        )
        for name, item in _items(row):
            yield (
                *own,
                span(str(item.bit), str(item.bit + item.bits - 1)),
                (f"{'->' if receives else '<-'} {name}", "cyan" if receives else "green"),
                item.object,
                item.type,
            )
            own = ("",) * len(own)


def _items(row: PdoRow) -> Iterator[tuple[str, PdoItem]]:
    yield from ((f"status: {word.name}", word) for word in row.status)
    yield from ((run.name, run) for run in row.runs)


def _time(duration: float | None) -> str:
    return "" if duration is None else seconds(duration)


def _shares(cell: ExpandedCell) -> list[str]:
    return [f"{rate // 1000}k {share:.0%}" for rate, share in load_by_bit_rate(cell).items()]


def _objects(first: str, last: str) -> str:
    """`2000h:01-40`; both in full where the index changes."""
    if first.partition(":")[0] == last.partition(":")[0] and first != last:
        return f"{first}-{last.partition(':')[2]}"
    return span(first, last)


TABLES: Final = CanopenTables()

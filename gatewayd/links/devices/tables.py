"""What this kind of link shows of a mapping: where variables lie in devices, and the devices."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Final

from gatewayd.core.definition import Direction
from gatewayd.links.devices.declaration import KIND
from gatewayd.links.devices.description import description
from gatewayd.links.devices.expand import devices_of, family_of
from gatewayd.links.devices.plan import DevicePlan
from gatewayd.links.devices.sections import DeviceSpec
from gatewayd.links.tables import LinkTables
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.plan import Plan
from gatewayd.report.layout import Column, ReportTable, Row, plain, span


class DeviceTables(LinkTables):
    """A row for each place of a variable."""

    key = KIND.key
    columns = (
        Column("device", "owner"),
        Column("device_place", "owner"),
        Column("device_type", "owner"),
        Column("device_scale", "owner", None),
        Column("device_offset", "owner", None),
        Column("device_poll", "owner", None),
        Column("device_pdo", "owner", None),
    )
    screen = ()
    page = ()

    def rows(self, cell: ExpandedCell) -> Mapping[int, Sequence[Mapping[str, object]]]:
        """Name of the device, the place in it, how the number is written there, and how it is carried."""
        pdos = {
            (name, number): label
            for name, device in cell.document.parts(DeviceSpec).items()
            for number, label in family_of(device.spec)
            .pdos(cell.document, device, devices_of(cell).of(name))
            .items()
        }
        numbers: Counter[str] = Counter()
        found: dict[int, list[Mapping[str, object]]] = {}
        for place in devices_of(cell).places:
            pdo = pdos.get((place.name, numbers[place.name]))
            numbers[place.name] += 1
            if place.device is None or place.where is None:
                continue
            words = family_of(place.device.spec).row(place.where)
            poll = place.poll if place.is_read and pdo is None else None
            row = {"device": place.name, **words, "device_poll": poll, "device_pdo": pdo}
            found.setdefault(place.variable.index, []).append(row)
        return found

    def on_screen(self, first: Row, last: Row) -> Mapping[str, str]:
        """The place in the device, where nothing else has the variable: `island discrete 3`."""
        if not first["device"]:
            return {}
        places = span(plain(first["device_place"]), plain(last["device_place"]))
        return {"address": f"{first['device']} {places}", "type": first["device_type"]}

    def on_page(self, row: Row) -> Mapping[str, str]:
        """Nothing: devices have a table of their own."""
        return {}

    def screen_table(self, cell: ExpandedCell) -> ReportTable:
        """Every place in every device."""
        head = ("device", "place", "type", "variable", "poll or PDO")
        rows = self.rows(cell)
        found = [
            (
                plain(row["device"]),
                plain(row["device_place"]),
                plain(row["device_type"]),
                f"{cell.variables[index].name} {'->' if cell.variables[index].direction is Direction.INPUT else '<-'}",
                plain(row["device_pdo"] or "")
                if row["device_poll"] is None
                else f"{row['device_poll']:.6g} s",
            )
            for index, places in rows.items()
            for row in places
        ]
        return ReportTable(head, tuple(found), title="Devices")

    def headline(self, plan: Plan) -> str:
        """The devices."""
        return f"devices {', '.join(plan.of(DevicePlan))}"

    def introduction(self, plan: Plan) -> str:
        """The devices and where they are."""
        found = (
            f"{name} ({description(each, plan.cell).address})" for name, each in plan.of(DevicePlan).items()
        )
        return f"Devices: {', '.join(found)}."

    def document(self, plan: Plan, cell: ExpandedCell) -> object:
        """Where each device is."""
        return {name: dict(description(each, plan.cell).fields) for name, each in plan.of(DevicePlan).items()}


TABLES: Final = DeviceTables()

"""What this kind of link shows of a mapping: the topic or metric of each variable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from gatewayd.links.mqtt.declaration import KIND
from gatewayd.links.mqtt.description import description
from gatewayd.links.mqtt.expand import publications_of, section_of
from gatewayd.links.mqtt.plan import MqttPlan
from gatewayd.links.tables import LinkTables
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.plan import Plan
from gatewayd.report.format import exact, seconds
from gatewayd.report.layout import Column, ReportTable, Row


class MqttTables(LinkTables):
    """A name for each variable that is published, and a table of its own on the screen."""

    key = KIND.key
    columns = (
        Column("mqtt_name", "owner"),
        Column("mqtt_interval", "owner", None),
        Column("mqtt_deadband", "owner", None),
    )
    screen = ()
    page = ()

    def rows(self, cell: ExpandedCell) -> Mapping[int, Sequence[Mapping[str, object]]]:
        """The topic, or by Sparkplug the metric."""
        part = section_of(cell.document)
        root = f"{part.spec.topic}/" if part is not None and part.spec.topic is not None else ""
        return {
            each.variable.index: [
                {
                    "mqtt_name": root + each.name,
                    "mqtt_interval": each.interval,
                    "mqtt_deadband": each.deadband or None,
                }
            ]
            for each in publications_of(cell)
        }

    def on_page(self, row: Row) -> Mapping[str, str]:
        """Nothing: it has a table of its own."""
        return {}

    def on_screen(self, first: Row, last: Row) -> Mapping[str, str]:
        """The same."""
        return {}

    def screen_table(self, cell: ExpandedCell) -> ReportTable | None:
        """Every value that the broker gets."""
        rows = tuple(
            (
                str(row["mqtt_name"]),
                cell.variables[index].name,
                seconds(float(str(row["mqtt_interval"]))),
                exact(float(str(row["mqtt_deadband"]))) if row["mqtt_deadband"] else "",
            )
            for index, found in self.rows(cell).items()
            for row in found
        )
        return ReportTable(("name", "variable", "interval", "deadband"), rows, title="MQTT") if rows else None

    def headline(self, plan: Plan) -> str:
        """The broker."""
        mqtt = plan.the(MqttPlan)
        return f"MQTT {description(mqtt).address}"

    def introduction(self, plan: Plan) -> str:
        """The broker, and where the cell is there."""
        found = description(plan.the(MqttPlan))
        return f"MQTT: broker {found.address}, topics below {found.fields['topic']}."

    def document(self, plan: Plan, cell: ExpandedCell) -> object:
        """The broker, the client and the root of topics."""
        return dict(description(plan.the(MqttPlan)).fields)


TABLES: Final = MqttTables()

"""What everybody may know of this kind of link."""

from __future__ import annotations

from collections.abc import Iterable

from gatewayd.core.definition import CellDefinition
from gatewayd.core.objection import Objection, ObjectionKind
from gatewayd.core.status_layout import StatusField
from gatewayd.links.contract import Description, LinkKind, LinkMetric, Place
from gatewayd.mapping.plan import LinkPlan
from gatewayd.report.format import address, seconds

from .plan import LinesPlan


class UdpLines(LinkKind):
    """The kind with the section `lines`."""

    key = LinesPlan.kind
    title = "JSON lines over UDP"
    doctor = f"{__package__}.doctor"
    fields = {"listen": "host:port of the socket", "to": "who gets the lines", "sent": "lines sent"}  # noqa: RUF012
    place = "name that the lines have for it, or null"
    has_one_place = True
    status_fields = (StatusField(60, 1, "lines_sent", "lines sent, wraps"),)
    metrics = (LinkMetric("gatewayd_lines_total", "lines", "lines, by direction", label="direction"),)

    def describe(self, plan: LinkPlan, cell: CellDefinition) -> Description:
        """Socket, receiver, names."""
        assert isinstance(plan, LinesPlan)
        listen, to = address(*plan.listen), address(*plan.to)
        return Description(
            settings={"listen": listen, "to": to, "period": seconds(plan.period)},
            places={
                variable: [Place(f"line {name}", {"name": name}, "line", name, "", "JSON")]
                for variable, name in plan.names
            },
            writers={writer: host for host, writer in plan.writers},
            address=listen,
            fields={"listen": listen, "to": to},
        )

    def fits(self, old: LinkPlan, new: LinkPlan, before: CellDefinition, after: CellDefinition) -> bool:
        """The socket stays where it listens."""
        assert isinstance(old, LinesPlan)
        assert isinstance(new, LinesPlan)
        return old.listen == new.listen

    def disturbs(
        self, old: LinkPlan, new: LinkPlan, before: CellDefinition, after: CellDefinition
    ) -> Iterable[Objection]:
        """Whoever listens would miss the lines."""
        assert isinstance(old, LinesPlan)
        assert isinstance(new, LinesPlan)
        if old.to != new.to:
            text = f"lines would go to {address(*new.to)} instead of {address(*old.to)}"
            yield Objection(ObjectionKind.WEAKENING, text)


KIND = UdpLines()

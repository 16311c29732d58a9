"""What everybody may know of this kind of link."""

from __future__ import annotations

from collections.abc import Iterable

from gatewayd.core.definition import CellDefinition
from gatewayd.core.objection import Objection, ObjectionKind
from gatewayd.core.status_layout import StatusField
from gatewayd.links.contract import Description, LinkKind, LinkMetric
from gatewayd.links.modbus_server.consent import weakened
from gatewayd.links.modbus_server.description import description
from gatewayd.links.modbus_server.plan import ModbusPlan, Network, network_text
from gatewayd.mapping.plan import LinkPlan


class ModbusServer(LinkKind):
    """The kind with the section `modbus`."""

    key = ModbusPlan.kind
    title = "Modbus TCP server"
    traffic = "gatewayd.links.modbus_server.traffic"
    exports = "gatewayd.links.modbus_server.exports"
    doctor = "gatewayd.links.modbus_server.doctor"
    usual = True
    fields = {  # noqa: RUF012 - never changed
        "listen": "host:port of the listener",
        "unit": "unit id",
        "connections": "open connections of the listener",
        "refused": "connections that the listener refused since it was opened, by reason",
        "ignored": "registers and bits with nothing mapped that accepted writes covered (`write_gaps: ignore`)",
        "tls": "the listener with TLS, null where there is none: `listen`, `listening`, `connections`, `refused` as "
        "above, `handshakes` under way, `expires`: seconds since 1970 by file",
    }
    status_fields = (
        StatusField(26, 1, "modbus_connections", "open Modbus connections to this unit's listener"),
    )
    metrics = (
        LinkMetric(
            "gatewayd_modbus_up",
            "listening",
            "1 while the listener accepts connections",
            shared=("listener", "listen"),
        ),
        LinkMetric(
            "gatewayd_modbus_connections",
            "connections",
            "open Modbus connections",
            shared=("listener", "listen"),
        ),
        LinkMetric(
            "gatewayd_modbus_refused_connections_total",
            "refused",
            "Modbus connections that were refused",
            label="reason",
            shared=("listener", "listen"),
        ),
        LinkMetric(
            "gatewayd_modbus_ignored_total",
            "ignored",
            "registers and bits with nothing mapped that accepted writes covered (write_gaps: ignore)",
        ),
        LinkMetric(
            "gatewayd_modbus_tls_up",
            "tls_listening",
            "1 while the Modbus listener with TLS accepts connections",
            shared=("listener", "tls_listen"),
        ),
        LinkMetric(
            "gatewayd_modbus_tls_connections",
            "tls_connections",
            "open Modbus connections with TLS",
            shared=("listener", "tls_listen"),
        ),
        LinkMetric(
            "gatewayd_modbus_tls_refused_connections_total",
            "tls_refused",
            "Modbus connections with TLS that were refused",
            label="reason",
            shared=("listener", "tls_listen"),
        ),
        LinkMetric(
            "gatewayd_modbus_tls_expiry_timestamp_seconds",
            "tls_expires",
            "when the first thing in a file of a Modbus listener with TLS expires, in seconds since 1970",
            label="file",
            shared=("listener", "tls_listen"),
        ),
    )
    place = "list of its places: `area`, `address` from 0, `bit` or null, `notation` (4xxxxx form)"

    def describe(self, plan: LinkPlan, cell: CellDefinition) -> Description:
        """The unit and its map."""
        assert isinstance(plan, ModbusPlan)
        return description(plan, cell)

    def disturbs(
        self, old: LinkPlan, new: LinkPlan, before: CellDefinition, after: CellDefinition
    ) -> Iterable[Objection]:
        """Somebody more could connect."""
        assert isinstance(old, ModbusPlan)
        assert isinstance(new, ModbusPlan)
        if old.allow and not (new.allow and all(_is_within(network, old.allow) for network in new.allow)):
            more = ", ".join(
                network_text(network) for network in new.allow if not _is_within(network, old.allow)
            )
            yield Objection(ObjectionKind.WEAKENING, f"{more or 'everybody'} could connect to modbus too")
        for text in weakened(old, new, before, after):
            yield Objection(ObjectionKind.WEAKENING, text)

    def fits(self, old: LinkPlan, new: LinkPlan, before: CellDefinition, after: CellDefinition) -> bool:
        """A unit always goes on; if it moves to another listener, its clients have to follow."""
        return True


def _is_within(network: Network, allowed: Iterable[Network]) -> bool:
    """Whether all of its addresses are in one of these networks."""
    first, last = network[0], network[-1]
    return any(first in known and last in known for known in allowed)


KIND = ModbusServer()
"""What everybody may know of this kind of link."""

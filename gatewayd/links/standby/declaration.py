"""What everybody may know of this kind of link."""

from __future__ import annotations

from gatewayd.core.definition import CellDefinition
from gatewayd.core.status_layout import StatusField
from gatewayd.links.contract import Description, LinkKind, LinkMetric
from gatewayd.links.standby.plan import StandbyPlan
from gatewayd.links.standby.roles import StandbyRole
from gatewayd.mapping.plan import LinkPlan
from gatewayd.report.format import address, seconds

ROLE_WORD = "standby_role"
_ROLES = ", ".join(f"{role.value} {role.words}" for role in StandbyRole)


class StandbyKind(LinkKind):
    """The kind with the section `standby`."""

    key = StandbyPlan.kind
    title = "two gateways"
    doctor = "gatewayd.links.standby.doctor"
    stands_by = True
    decides = True
    fields = {  # noqa: RUF012 - never changed
        "role": f"{', '.join(f'`{role.words}`' for role in StandbyRole)}",
        "reason": "why it has this role, or empty",
        "since": "seconds for which it has it, or null",
        "takeovers": "times that this gateway came to serve the cell since its start",
        "claim": "of the robot's inputs: `no session`, `unasked`, `asked`, `held`, `partial`, `refused`",
        "peer": "list of host:port of the other gateway; of both where the file names both",
        "peer_role": "role of the other gateway, or null while it is not heard",
        "peer_age": "seconds since it was heard, or null",
        "peer_ready": "whether it would take over at once",
        "peer_fingerprint": "that of its mapping, or null",
        "mismatch": "whether its mapping differs",
        "strange": "datagrams that were none of the other gateway's, or answered nothing that was sent to it",
        "address": "the virtual address, or null",
        "address_here": "whether this machine has it, or null where that is not known",
        "file": "what keepalived follows, or null",
        "obstacle": "why the cell cannot be handed over now, or empty",
    }
    status_fields = (
        StatusField(
            56, 1, ROLE_WORD, f"of two gateways: 0 none declared, {_ROLES}; plus 256 while the other is ready"
        ),
    )
    metrics = (
        LinkMetric("gatewayd_standby_active", "active", "1 while this gateway of two serves the cell"),
        LinkMetric("gatewayd_standby_peer_ready", "peer_ready", "1 while the other gateway would take over"),
        LinkMetric("gatewayd_standby_mismatch", "mismatch", "1 while the other gateway has another mapping"),
        LinkMetric(
            "gatewayd_standby_takeovers_total", "takeovers", "times that this gateway came to serve the cell"
        ),
    )

    def describe(self, plan: LinkPlan, cell: CellDefinition) -> Description:
        """Settings and addresses."""
        assert isinstance(plan, StandbyPlan)
        peers = ", ".join(address(*peer) for peer in plan.peers)
        return Description(
            settings={
                "peer": peers,
                "listen": address(*plan.listen) if plan.listen is not None else "",
                "address": plan.address,
                "grace": seconds(cell.adopt_for) or "none",
            },
            address=plan.address or peers,
            fields={"peer": [address(*peer) for peer in plan.peers], "address": plan.address or None},
        )

    def fits(self, old: LinkPlan, new: LinkPlan, before: CellDefinition, after: CellDefinition) -> bool:
        """It goes on in any case: its role must not be lost by a reload."""
        return True


KIND = StandbyKind()
"""What everybody may know of this kind of link."""

"""What `gatewayd doctor` looks at of a pair: which of the two this machine is, the way to the other, what is heard."""

from __future__ import annotations

from collections.abc import AsyncIterator, Collection, Iterator, Mapping
from typing import Any

from gatewayd.core.definition import CellDefinition
from gatewayd.links.examination import Examination, Observation, Outcome, Surroundings
from gatewayd.links.route import look_up_route
from gatewayd.links.standby.declaration import KIND
from gatewayd.links.standby.plan import StandbyPlan
from gatewayd.machine.addresses import own_addresses
from gatewayd.mapping.plan import LinkPlan
from gatewayd.report.format import address

CHECK = "second gateway"


class StandbyExamination(Examination):
    """Sends nothing: what is heard of the other gateway says the one that runs here."""

    async def examine(
        self, plan: LinkPlan, cell: CellDefinition, around: Surroundings
    ) -> AsyncIterator[Observation]:
        """See Examination."""
        assert isinstance(plan, StandbyPlan)
        try:
            own = own_addresses()
        except OSError as error:
            yield Observation(CHECK, Outcome.SKIPPED, f"the kernel was not asked: {error.strerror or error}")
            own = frozenset()
        for found in who_is_who(plan, own):
            yield found
        for host, _port in plan.peers:
            if host not in own:
                for found in look_up_route(host, "the other gateway"):
                    yield found
        running = [
            link for known in around.running if known.name == cell.name for link in known.links(KIND.title)
        ]
        for found in heard(running[0] if running else None):
            yield found


def who_is_who(plan: StandbyPlan, own: Collection[str]) -> Iterator[Observation]:
    """Whether the mapping, on a machine with these addresses, says who is the other gateway."""
    names = " and ".join(address(*peer) for peer in plan.peers)
    here = [host for host, _port in plan.peers if host in own]
    others = len(plan.peers) - len(here)
    if others == 1 or not own:
        yield Observation.well(
            CHECK, f"the other one is among {names}" if here else f"the other one is {names}"
        )
        return
    yield Observation(
        CHECK,
        Outcome.PROBLEM,
        f"this machine has {'both' if here else 'neither'} of {names}",
        "the addresses in `peer` are not those of the two machines, or an interface is not up",
        "give in `peer` the own address of each machine, never the virtual one",
    )


def heard(link: Mapping[str, Any] | None) -> Iterator[Observation]:
    """What the gateway that runs here says of the other one; None: none runs."""
    if link is None:
        yield Observation(
            CHECK, Outcome.SKIPPED, "no gateway runs here that could have heard the other one: start it first"
        )
        return
    if link.get("peer_role") is None:
        yield Observation(
            CHECK,
            Outcome.PROBLEM,
            "the other gateway is not heard: nobody would take over",
            "it does not run, or a firewall between the two drops UDP to the port in `peer`",
            "start it, and allow the port on both machines",
        )
    elif link.get("mismatch"):
        yield Observation(
            CHECK,
            Outcome.PROBLEM,
            f"the other gateway has another mapping ({link.get('peer_fingerprint')})",
            "the file was changed on one machine only",
            "install the same file on both and `gatewayd reload` both",
        )
    else:
        yield Observation.well(
            CHECK, f"this gateway is {link.get('role')}, the other one {link.get('peer_role')}"
        )
    if link.get("address") and link.get("role") == "active" and not link.get("address_here"):
        yield Observation(
            CHECK,
            Outcome.PROBLEM,
            f"this gateway is active without {link.get('address')}",
            "keepalived does not run, or does not follow the file",
            f"see `systemctl status keepalived`; its `track_file` is {link.get('file')}",
        )


EXAMINATION = StandbyExamination()
"""Looks at what this kind of link needs."""

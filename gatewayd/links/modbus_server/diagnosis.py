"""What a look at the address of a listener means. Pure; the looks are in `doctor`."""

from __future__ import annotations

import errno
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from gatewayd.links.examination import Observation, Outcome
from gatewayd.report.format import address, counted

if TYPE_CHECKING:
    from gatewayd.links.modbus_server.trust_findings import TrustFinding

ADDRESS, PORT, PRIVILEGE, FILES = "address", "port", "privilege", "certificates"
_UNSEEN = "a process of another user (`sudo ss -ltnp` names it)"


@dataclass(frozen=True, slots=True)
class PortFacts:
    """What was seen of this machine."""

    first_unprivileged: int
    """Ports below need a privilege (net.ipv4.ip_unprivileged_port_start)."""
    privileged: bool
    """Whether this process has it."""
    holder: str
    """The process that listens on the port; empty: nobody, or not to be seen."""
    user: int
    """Who looks, by number."""
    listened: bool = False
    """Whether anybody listens on the port, at whatever address."""


def served(where: str, links: Sequence[Mapping[str, Any]]) -> Observation:
    """The gateway on this machine has the address."""
    connections = sum(int(link.get("connections") or 0) for link in links[:1])
    return Observation.well(
        PORT, f"{where} is served by the running gateway, {counted(connections, 'connection')}"
    )


def listener(host: str, port: int, failure: OSError | None, facts: PortFacts) -> Iterator[Observation]:
    """Whether a gateway could listen there."""
    where = address(host, port)
    if failure is not None and (_is_of_name(failure) or failure.errno == errno.EADDRNOTAVAIL):
        yield _no_address(host, failure)
        return
    yield Observation.well(ADDRESS, f"{host} is an address of this machine")
    if port < facts.first_unprivileged:
        yield _privilege(port, facts)
    if failure is None:
        yield Observation.well(PORT, f"{where} is free")
    elif failure.errno == errno.EADDRINUSE:
        yield _taken(where, facts)
    elif failure.errno in (errno.EACCES, errno.EPERM):
        if facts.listened:
            who = facts.holder or _UNSEEN
            text = f"who listens on port {port} already is {who}: whether at this address shows only with the privilege"
            yield Observation(PORT, Outcome.NOTE, text)
    else:
        remedy = "try it by hand: `gatewayd run` says the same"
        yield Observation(PORT, Outcome.PROBLEM, f"{where}: {_reason(failure)}", "not known", remedy)


def of_client(found: Observation, name: str, where: str) -> Observation:
    """The way to a declared writer; one that has none can connect all the same, if its own packages arrive."""
    outcome = Outcome.WARNING if found.outcome is Outcome.PROBLEM else found.outcome
    return replace(found, check=f"way to {name}", outcome=outcome, text=f"{where}: {found.text}")


def of_file(path: str, finding: TrustFinding) -> Observation:
    """Something that is wrong with a file of a listener with TLS."""
    outcome = Outcome.PROBLEM if finding.unusable else Outcome.WARNING
    cause = "clients with TLS are not served" if finding.unusable else "clients with TLS are served meanwhile"
    return Observation(FILES, outcome, f"{path} {finding.text}", cause, finding.remedy)


def files_well(paths: str) -> Observation:
    """They are as they must be."""
    return Observation.well(FILES, f"{paths}: in order")


def _no_address(host: str, failure: OSError) -> Observation:
    if _is_of_name(failure):
        text, cause = f"{host}: {_reason(failure)}", "the name is misspelt, or no name server knows it"
    else:
        text, cause = (
            f"this machine has no address {host}",
            "another machine's address, or its interface is not up yet",
        )
    remedy = "listen on an address of this machine (`ip address`), or on 0.0.0.0 (`modbus: listen:`)"
    return Observation(ADDRESS, Outcome.PROBLEM, text, cause, remedy)


def _privilege(port: int, facts: PortFacts) -> Observation:
    rule = f"ports below {facts.first_unprivileged} need CAP_NET_BIND_SERVICE"
    if facts.privileged:
        return Observation.well(PRIVILEGE, f"{rule}, which this process has")
    return Observation(
        PRIVILEGE,
        Outcome.WARNING,
        f"user {facts.user} may not listen on port {port}: {rule}",
        "a gateway that is started by this user cannot listen; the packaged service can",
        "run it as the service, or grant it: `sysctl net.ipv4.ip_unprivileged_port_start=502`, or a port from "
        f"{facts.first_unprivileged} on",
    )


def _taken(where: str, facts: PortFacts) -> Observation:
    who = facts.holder or _UNSEEN
    return Observation(
        PORT,
        Outcome.PROBLEM,
        f"{where} is taken by {who}",
        "another Modbus server, or a gateway that was not found here (--socket names its control socket)",
        "stop that program, or choose another port (`modbus: listen:`)",
    )


def _is_of_name(failure: OSError) -> bool:
    """Whether the name was not found: the errors of the name service have negative numbers."""
    return isinstance(failure, TimeoutError) or (failure.errno or 0) < 0


def _reason(failure: OSError) -> str:
    if isinstance(failure, TimeoutError):
        return "no answer of the name service in time"
    return failure.strerror or str(failure)

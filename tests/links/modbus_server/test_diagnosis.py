from __future__ import annotations

import errno
import os
import socket

import pytest

from gatewayd.links.examination import Observation, Outcome
from gatewayd.links.modbus_server.diagnosis import PortFacts, listener, of_client, served

FACTS = PortFacts(1024, privileged=False, holder="", user=1000)


def failed(number: int) -> OSError:
    return OSError(number, os.strerror(number))


def looked(failure: OSError | None, *, port: int = 1502, facts: PortFacts = FACTS) -> list[str]:
    return [
        f"{seen.check} {seen.outcome.value}: {seen.text}"
        for seen in listener("192.0.2.7", port, failure, facts)
    ]


ADDRESS = "address ok: 192.0.2.7 is an address of this machine"


def test_a_free_port_is_well() -> None:
    assert looked(None) == [ADDRESS, "port ok: 192.0.2.7:1502 is free"]


@pytest.mark.parametrize(
    "holder, words", [("plcd (pid 7)", "plcd (pid 7)"), ("", "a process of another user")]
)
def test_a_taken_port_has_who_has_it(holder: str, words: str) -> None:
    facts = PortFacts(1024, privileged=False, holder=holder, user=1000)
    _, taken = looked(failed(errno.EADDRINUSE), facts=facts)
    assert taken.startswith(f"port problem: 192.0.2.7:1502 is taken by {words}")


def test_an_address_of_another_machine_ends_the_look() -> None:
    (found,) = listener("192.0.2.7", 502, failed(errno.EADDRNOTAVAIL), FACTS)
    assert (found.check, found.outcome) == ("address", Outcome.PROBLEM)
    assert "`ip address`" in found.remedy


@pytest.mark.parametrize(
    "failure", [socket.gaierror(socket.EAI_NONAME, "Name or service not known"), TimeoutError()]
)
def test_a_name_that_nobody_knows_is_a_problem_of_the_address(failure: OSError) -> None:
    (found,) = listener("gateway", 502, failure, FACTS)
    assert found.check == "address"
    assert found.text in (
        "gateway: Name or service not known",
        "gateway: no answer of the name service in time",
    )


@pytest.mark.parametrize("privileged, outcome", [(True, Outcome.OK), (False, Outcome.WARNING)])
def test_a_privileged_port_needs_the_capability(privileged: bool, outcome: Outcome) -> None:
    facts = PortFacts(1024, privileged, "", 1000)
    failure = None if privileged else failed(errno.EACCES)
    _, privilege, *port = listener("192.0.2.7", 502, failure, facts)
    assert (privilege.check, privilege.outcome) == ("privilege", outcome)
    assert len(port) == privileged


def test_who_may_not_try_the_port_sees_at_least_that_somebody_listens() -> None:
    facts = PortFacts(1024, privileged=False, holder="", user=1000, listened=True)
    *_, port = listener("192.0.2.7", 502, failed(errno.EACCES), facts)
    assert (port.check, port.outcome) == ("port", Outcome.NOTE)
    assert "a process of another user" in port.text


def test_the_sysctl_counts() -> None:
    facts = PortFacts(502, privileged=False, holder="", user=1000)
    assert looked(None, port=502, facts=facts) == [ADDRESS, "port ok: 192.0.2.7:502 is free"]


def test_what_cannot_be_explained_is_reported_as_it_is() -> None:
    _, found = looked(failed(errno.EMFILE))
    assert found == f"port problem: 192.0.2.7:1502: {os.strerror(errno.EMFILE)}"


def test_the_running_gateway_has_its_port() -> None:
    found = served("0.0.0.0:502", [{"connections": 2}, {"connections": 2}])
    assert found == Observation.well("port", "0.0.0.0:502 is served by the running gateway, 2 connections")
    assert "no connections" in served("0.0.0.0:502", [{}]).text


def test_no_way_to_a_client_is_less_than_none_to_the_robot() -> None:
    found = of_client(Observation("route", Outcome.PROBLEM, "no route"), "plc", "192.0.2.20")
    assert (found.check, found.outcome, found.text) == ("way to plc", Outcome.WARNING, "192.0.2.20: no route")
    assert of_client(Observation.well("route", "by eth0"), "plc", "192.0.2.20").outcome is Outcome.OK

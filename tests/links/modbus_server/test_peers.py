from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from ipaddress import ip_address, ip_network

import pytest

from gatewayd.links.modbus_server.peers import (
    OTHER_PEERS,
    PeerEvent,
    PeerEventKind,
    PeerLog,
    address_of,
    known_as,
    may_connect,
)
from gatewayd.links.modbus_server.plan import ModbusPlan

FULL = PeerEventKind.FULL


@pytest.mark.parametrize(
    "host,address",
    [
        ("192.0.2.20", "192.0.2.20"),
        ("::ffff:192.0.2.20", "192.0.2.20"),
        ("::1", "::1"),
        ("fe80::1%eth0", "fe80::1"),
    ],
)
def test_address_of_a_peer(host: str, address: str) -> None:
    assert address_of(host) == ip_address(address)


def test_the_first_network_that_has_the_peer_names_the_writer(plan_of: Callable[..., ModbusPlan]) -> None:
    """The plan has the most specific one first."""
    writers = ((ip_network("192.0.2.7/32"), 3), (ip_network("fd00::/8"), 4), (ip_network("192.0.2.0/24"), 5))
    plan = replace(plan_of(), writers=writers)
    assert known_as(ip_address("192.0.2.7"), None, plan) == (writers[0][0], 3)
    assert known_as(ip_address("192.0.2.8"), None, plan) == (writers[2][0], 5)
    assert known_as(ip_address("fd00::1"), None, plan) == (writers[1][0], 4)
    assert known_as(ip_address("198.51.100.7"), None, plan) is None


def test_without_an_access_list_everybody_may_connect(plan_of: Callable[..., ModbusPlan]) -> None:
    assert may_connect(ip_address("203.0.113.9"), plan_of())


def test_an_access_list_names_who_may(plan_of: Callable[..., ModbusPlan]) -> None:
    plan = plan_of(allow=("192.0.2.0/24", "fd00::/8"))
    assert may_connect(ip_address("192.0.2.9"), plan)
    assert may_connect(ip_address("fd00::9"), plan)
    assert not may_connect(ip_address("198.51.100.9"), plan)
    assert not may_connect(ip_address("fe80::9"), plan)


def test_a_peer_that_knocks_all_the_time_is_reported_once_a_minute_with_the_number() -> None:
    log = PeerLog(60.0)
    assert log.reports("192.0.2.9", FULL, 0.0)
    assert not any(log.reports("192.0.2.9", FULL, 0.5 * number) for number in range(1, 100))
    assert log.reports("192.0.2.9", PeerEventKind.DENIED, 50.0), "another reason"
    assert log.reports("192.0.2.8", FULL, 59.0), "another peer"
    assert list(log.kept_back(59.9)) == []
    assert list(log.kept_back(60.0)) == [PeerEvent(FULL, "192.0.2.9", repeats=99)]
    assert log.reports("192.0.2.9", FULL, 60.1)
    assert list(log.kept_back(math.inf)) == [], "nothing was kept back of the others"


def test_a_peer_that_comes_and_goes_is_reported_ten_times_a_minute() -> None:
    log = PeerLog(60.0)
    reported = [log.reports("192.0.2.9", PeerEventKind.CONNECTED, 0.1 * number) for number in range(100)]
    assert reported == [True] * 10 + [False] * 90
    assert list(log.kept_back(60.0)) == [PeerEvent(PeerEventKind.CONNECTED, "192.0.2.9", repeats=90)]


def test_a_thousand_addresses_take_no_more_room_and_lines_than_a_few() -> None:
    log = PeerLog(60.0, max_peers=8)
    reported = [log.reports(str(number), FULL, 0.0) for number in range(1000)]
    assert reported == [True] * 9 + [False] * 991, "the ninth stands for all others"
    assert len(log._known) == 9
    assert list(log.kept_back(60.0)) == [PeerEvent(FULL, OTHER_PEERS, repeats=991)]
    assert not log._known

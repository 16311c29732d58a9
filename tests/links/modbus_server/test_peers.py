from __future__ import annotations

from collections.abc import Callable
from ipaddress import ip_address, ip_network

import pytest

from gatewayd.links.modbus_server.peers import DenialLog, address_of, may_connect, writer_of
from gatewayd.links.modbus_server.plan import ModbusPlan


@pytest.mark.parametrize(
    "host,address",
    [
        ("192.168.1.20", "192.168.1.20"),
        ("::ffff:192.168.1.20", "192.168.1.20"),
        ("::1", "::1"),
        ("fe80::1%eth0", "fe80::1"),
    ],
)
def test_address_of_a_peer(host: str, address: str) -> None:
    assert address_of(host) == ip_address(address)


def test_the_first_network_that_has_the_peer_names_the_writer() -> None:
    """The plan has the most specific one first."""
    writers = ((ip_network("10.0.0.7/32"), 3), (ip_network("fd00::/8"), 4), (ip_network("10.0.0.0/24"), 5))
    assert writer_of(ip_address("10.0.0.7"), writers) == 3
    assert writer_of(ip_address("10.0.0.8"), writers) == 5
    assert writer_of(ip_address("fd00::1"), writers) == 4
    assert writer_of(ip_address("10.0.1.7"), writers) is None


def test_without_an_access_list_everybody_may_connect(plan_of: Callable[..., ModbusPlan]) -> None:
    assert may_connect(ip_address("203.0.113.9"), plan_of())


def test_an_access_list_names_who_may(plan_of: Callable[..., ModbusPlan]) -> None:
    plan = plan_of(allow=("10.0.0.0/24", "fd00::/8"))
    assert may_connect(ip_address("10.0.0.9"), plan)
    assert may_connect(ip_address("fd00::9"), plan)
    assert not may_connect(ip_address("10.0.1.9"), plan)
    assert not may_connect(ip_address("fe80::9"), plan)


def test_denials_of_one_address_are_reported_once_per_interval() -> None:
    log = DenialLog(60.0)
    assert log.repeats("10.0.0.9", 0.0) == 0
    assert log.repeats("10.0.0.9", 1.0) is None
    assert log.repeats("10.0.0.9", 59.0) is None
    assert log.repeats("10.0.0.8", 59.0) == 0
    assert log.repeats("10.0.0.9", 60.0) == 2


def test_denials_of_a_thousand_addresses_take_no_more_room_than_a_few() -> None:
    log = DenialLog(60.0, max_hosts=8)
    for number in range(1000):
        assert log.repeats(str(number), 0.0) == 0
    assert len(log._reported) == 8

"""Who is let in where not everybody can be."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from ipaddress import ip_address, ip_network

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.core.requester import Requester
from gatewayd.links.modbus_server.functions import Unit
from gatewayd.links.modbus_server.peers import Address, PeerEventKind, Place
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.links.modbus_server.session import UnitAccess
from gatewayd.links.modbus_server.shares import UNUSED_AFTER, Shares
from gatewayd.links.modbus_server.writers import Accesses
from tests.links.modbus_server.conftest import NOW, PLC

PlanOf = Callable[..., ModbusPlan]
READER, OTHER_READER, THIRD_READER = "127.0.0.1", "127.0.0.8", "127.0.0.9"
PLC_ADDRESS, HMI_ADDRESS, LINE_ADDRESS = "127.0.0.2", "127.0.0.3", "127.0.1.7"


@dataclass(eq=False)
class Peer:
    """As much of a connection as shares look at; by default one in use."""

    address: Address
    places: frozenset[Place]
    last_request: float = NOW
    accesses: Accesses = field(default_factory=dict)


@dataclass(eq=False)
class Hall:
    """A listener without sockets: peers come and stay."""

    shares: Shares
    present: list[Peer] = field(default_factory=list)

    def enter(self, address: str, last_request: float = NOW) -> str:
        """`let in`, whom it has displaced, or why it was refused."""
        its = ip_address(address)
        newcomer = Peer(its, self.shares.places_of(its), last_request)
        room = self.shares.room_for(newcomer, self.present, NOW)
        if isinstance(room, PeerEventKind):
            return room.name
        for former in room:
            self.present.remove(former)
        self.present.append(newcomer)
        return ", ".join(str(former.address) for former in room) or "let in"

    def count(self, address: str) -> int:
        return [str(peer.address) for peer in self.present].count(address)


@pytest.fixture
def hall_of(plan_of: PlanOf) -> Callable[..., Hall]:
    """PLC, HMI and everybody in 127.0.1.0/24 are declared; a limit for each peer only if asked for."""

    def make(connections: int, per_peer: int | None = None) -> Hall:
        plan = plan_of(connections=connections)
        writers = (*plan.writers, (ip_network("127.0.1.0/24"), PLC))
        plan = replace(plan, writers=writers, connections_per_peer=per_peer or connections)
        return Hall(Shares((plan,)))

    return make


def test_a_reader_is_kept_from_the_places_of_writers(hall_of: Callable[..., Hall]) -> None:
    hall = hall_of(6)
    assert [hall.enter(READER) for _ in range(4)] == ["let in"] * 3 + ["FULL"]
    assert [hall.enter(address) for address in (PLC_ADDRESS, HMI_ADDRESS, LINE_ADDRESS)] == ["let in"] * 3
    assert len(hall.present) == 6


def test_a_place_is_kept_again_once_its_writer_has_gone(hall_of: Callable[..., Hall]) -> None:
    hall = hall_of(4)
    assert [hall.enter(PLC_ADDRESS), hall.enter(READER), hall.enter(READER)] == ["let in", "let in", "FULL"]
    del hall.present[0]
    assert hall.enter(READER) == "FULL"
    assert hall.enter(PLC_ADDRESS) == "let in"


def test_a_writer_with_many_connections_keeps_no_other_writer_out(hall_of: Callable[..., Hall]) -> None:
    hall = hall_of(6)
    assert [hall.enter(PLC_ADDRESS) for _ in range(6)] == ["let in"] * 4 + ["FULL"] * 2
    assert [hall.enter(HMI_ADDRESS), hall.enter(LINE_ADDRESS)] == ["let in"] * 2


def test_a_limit_for_each_peer_goes_for_writers_too(hall_of: Callable[..., Hall]) -> None:
    hall = hall_of(32, per_peer=2)
    for address in (READER, PLC_ADDRESS, LINE_ADDRESS):
        assert [hall.enter(address) for _ in range(3)] == ["let in", "let in", "CROWDED"]
    assert hall.enter("127.0.1.8") == "let in", "another address of the same network"


def test_a_peer_at_its_limit_displaces_what_it_does_not_use_itself(hall_of: Callable[..., Hall]) -> None:
    """It may have lost a connection without the gateway's hearing of it."""
    hall = hall_of(32, per_peer=2)
    hall.enter(OTHER_READER, NOW - 1000)
    hall.enter(READER, NOW - UNUSED_AFTER)
    hall.enter(READER, NOW - UNUSED_AFTER + 0.1)
    assert hall.enter(READER) == READER
    assert hall.enter(READER) == "CROWDED"
    assert hall.count(OTHER_READER) == 1


def test_a_connection_that_never_asked_is_as_old_as_it_is(hall_of: Callable[..., Hall]) -> None:
    """`last_request` begins with the connection: who only connects holds nothing for long."""
    hall = hall_of(4, per_peer=4)
    hall.enter(READER, NOW - UNUSED_AFTER)
    assert hall.enter(OTHER_READER) == READER


def test_readers_make_room_for_a_writer_the_one_unused_longest_first(hall_of: Callable[..., Hall]) -> None:
    """However busy they are: a second connection of the PLC counts more than any reader."""
    hall = hall_of(6)
    for age, address in ((0.1, READER), (0.3, OTHER_READER), (0.2, THIRD_READER)):
        assert hall.enter(address, NOW - age) == "let in"
    assert [hall.enter(PLC_ADDRESS) for _ in range(5)] == [
        "let in", OTHER_READER, THIRD_READER, READER, "FULL",
    ]  # fmt: skip


def test_no_writer_ever_makes_room_for_a_reader(hall_of: Callable[..., Hall]) -> None:
    hall = hall_of(4)
    for address in (PLC_ADDRESS, PLC_ADDRESS, HMI_ADDRESS, LINE_ADDRESS):
        assert hall.enter(address, NOW - 1000) == "let in"
    assert hall.enter(READER) == "FULL"


def test_a_writer_displaces_what_another_does_not_need(hall_of: Callable[..., Hall]) -> None:
    """Never the only connection of one: its place would have to be kept in its stead."""
    hall = hall_of(4)
    for age, address in ((500, PLC_ADDRESS), (400, HMI_ADDRESS), (200, LINE_ADDRESS), (100, LINE_ADDRESS)):
        assert hall.enter(address, NOW - age) == "let in"
    hall.present[0].last_request = NOW
    assert hall.enter(PLC_ADDRESS) == LINE_ADDRESS
    assert hall.enter(PLC_ADDRESS) == "FULL", "the unused ones are the only ones of their writers"
    assert hall.enter(LINE_ADDRESS) == LINE_ADDRESS, "its own"


def test_peers_come_to_have_equal_shares(hall_of: Callable[..., Hall]) -> None:
    """And nobody takes a place back from whom he gave it to."""
    hall = hall_of(11)
    assert [hall.enter(READER) for _ in range(9)] == ["let in"] * 8 + ["FULL"]
    assert [hall.enter(OTHER_READER) for _ in range(5)] == [READER] * 4 + ["FULL"]
    assert hall.enter(READER) == "FULL"
    assert hall.enter(THIRD_READER) in (READER, OTHER_READER)
    assert hall.enter(THIRD_READER) in (READER, OTHER_READER)
    assert sorted(map(hall.count, (READER, OTHER_READER, THIRD_READER))) == [2, 3, 3]
    assert [hall.enter(address) for address in (READER, OTHER_READER, THIRD_READER)] == ["FULL"] * 3


def test_what_holds_a_lock_makes_room_for_nobody(
    plan_of: PlanOf, unit: Unit, index_of: Callable[[str], int]
) -> None:
    requester = Requester(PLC, connection=7)
    assert unit.cell.request(requester, index_of("part"), NOW) is None
    shares = Shares((replace(plan_of(connections=2), connections_per_peer=2),))
    address = ip_address(PLC_ADDRESS)
    places = shares.places_of(address)
    owner = Peer(address, places, NOW - 1000, {1: UnitAccess(unit, requester)})
    idle = Peer(address, places, NOW - 900)
    newcomer = Peer(address, places)
    assert shares.room_for(newcomer, [owner, idle], NOW) == [idle]
    assert shares.room_for(newcomer, [owner, replace(owner)], NOW) is PeerEventKind.CROWDED


def test_more_writers_than_connections_leave_a_reader_one(hall_of: Callable[..., Hall]) -> None:
    """`check` warns of that. The writers still come first."""
    hall = hall_of(2)
    assert [hall.enter(READER), hall.enter(READER)] == ["let in", "FULL"]
    assert [hall.enter(PLC_ADDRESS), hall.enter(HMI_ADDRESS)] == ["let in", READER]
    assert hall.enter(LINE_ADDRESS) == "FULL"
    hall.present[0].last_request = NOW - UNUSED_AFTER
    assert hall.enter(LINE_ADDRESS) == PLC_ADDRESS


def test_fewer_connections_than_are_there_are_reached_by_and_by(hall_of: Callable[..., Hall]) -> None:
    """After a reload."""
    hall = hall_of(8)
    assert [hall.enter(READER) for _ in range(5)] == ["let in"] * 5
    hall.shares = hall_of(4).shares
    assert hall.enter(OTHER_READER) == "FULL", "not by one: four would have to go"
    assert hall.enter(PLC_ADDRESS) == f"{READER}, {READER}"
    assert len(hall.present) == 4


def test_of_several_units_the_most_generous_count(plan_of: PlanOf) -> None:
    """A peer fills its place in each unit that it may reach."""
    plans = [
        replace(plan_of(1, connections=4, allow=("127.0.0.2/32",)), connections_per_peer=3),
        replace(
            plan_of(2, connections=9), connections_per_peer=2, writers=((ip_network("127.0.0.0/8"), PLC),)
        ),
    ]
    hall = Hall(Shares(plans))
    networks = {ip_network("127.0.0.2/32"), ip_network("127.0.0.0/8")}
    assert hall.shares.places_of(ip_address(PLC_ADDRESS)) == networks
    assert hall.shares.places_of(ip_address(READER)) == {ip_network("127.0.0.0/8")}
    assert [hall.enter(PLC_ADDRESS) for _ in range(4)] == ["let in"] * 3 + ["CROWDED"]


def test_without_units_nobody_is_let_in() -> None:
    assert Hall(Shares(())).enter(READER) == "CROWDED"


@given(
    st.lists(
        st.tuples(
            st.sampled_from([READER, OTHER_READER, PLC_ADDRESS, HMI_ADDRESS, LINE_ADDRESS, "127.0.1.8"]),
            st.sampled_from([0.0, 1.0, 20.0]),
            st.booleans(),
        ),
        max_size=60,
    ),
    st.integers(3, 9),
)
def test_whatever_comes_a_declared_writer_that_is_not_there_gets_in(
    coming: list[tuple[str, float, bool]], connections: int
) -> None:
    writers = tuple((ip_network(text), PLC) for text in (PLC_ADDRESS, HMI_ADDRESS, "127.0.1.0/24"))
    plan = ModbusPlan("", 0, 1, (), connections, None, False, (), writers, connections_per_peer=5)
    hall = Hall(Shares((plan,)))
    for address, age, leaves in coming:
        if leaves and hall.present:
            del hall.present[0]
        its = ip_address(address)
        absent = not hall.shares.places_of(its) <= {place for peer in hall.present for place in peer.places}
        assert hall.enter(address, NOW - age) not in ("FULL", "CROWDED") or not absent
        assert len(hall.present) <= connections
        assert max(hall.count(str(peer.address)) for peer in [*hall.present, Peer(its, frozenset())]) <= 5

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.frame import Frame
from gatewayd.canopen.identity import Identity
from gatewayd.canopen.lss import Command, LssSlave, LssState
from gatewayd.canopen.nmt import UNCONFIGURED
from tests.links.canopen_node.wire import Wire

IDENTITY = Identity(0, 0x4757_4401, 0x0001_0002, 0xCAFE_F00D)
ADDRESS = (IDENTITY.vendor, IDENTITY.product, IDENTITY.revision, IDENTITY.serial)


class Slave:
    """An LSS slave with a notebook, and the requests of a master."""

    def __init__(self, node: int = 5, *, stores: bool = True) -> None:
        self.wire = Wire()
        self.booted = 0
        self.stored: list[tuple[int, int]] = []
        self.activated: list[tuple[int, float]] = []
        self.stores = stores
        self.lss = LssSlave(
            self.wire.send,
            IDENTITY,
            node,
            500_000,
            bit_rates=frozenset({500_000, 250_000}),
            configured=self._configured,
            store=self._store,
            activate=lambda rate, delay, _now: self.activated.append((rate, delay)),
        )

    def _configured(self, now: float) -> None:
        self.booted += 1

    def _store(self, node: int, bit_rate: int, answer: Callable[[bool], None]) -> None:
        self.stored.append((node, bit_rate))
        answer(self.stores)

    @property
    def state(self) -> str:
        return self.lss.state.value

    def ask(self, *data: int) -> bytes | None:
        """Send a request; the answer without its padding, if one came."""
        self.lss.receive(Frame(0x7E5, bytes(data).ljust(8, b"\0")), 0.0)
        frames = self.wire.take()
        assert len(frames) <= 1
        if not frames:
            return None
        assert (frames[0].can_id, len(frames[0].data)) == (0x7E4, 8)
        return frames[0].data

    def ask_number(self, command: int, number: int, *rest: int) -> bytes | None:
        return self.ask(command, *number.to_bytes(4, "little"), *rest)

    def configure(self) -> None:
        assert self.ask(Command.SWITCH_GLOBAL, 1) is None
        assert self.state == "configuration"


def answer(*data: int) -> bytes:
    return bytes(data).ljust(8, b"\0")


def test_switch_global_has_no_answer() -> None:
    slave = Slave()
    slave.configure()
    assert slave.ask(Command.SWITCH_GLOBAL, 7) is None
    assert slave.state == "configuration"
    assert slave.ask(Command.SWITCH_GLOBAL, 0) is None
    assert slave.state == "waiting"


def test_switch_selective_wants_the_whole_address() -> None:
    slave = Slave()
    answers = [slave.ask_number(0x40 + part, number) for part, number in enumerate(ADDRESS)]
    assert answers == [None, None, None, answer(Command.SELECTED)]
    assert slave.lss.state is LssState.CONFIGURATION


@pytest.mark.parametrize("part", range(4))
def test_switch_selective_of_another_address(part: int) -> None:
    slave = Slave()
    wanted = [number ^ (1 if at == part else 0) for at, number in enumerate(ADDRESS)]
    assert not any(slave.ask_number(0x40 + at, number) for at, number in enumerate(wanted))
    assert slave.lss.state is LssState.WAITING


def test_switch_selective_out_of_order_is_no_address() -> None:
    slave = Slave()
    for part in (0, 2, 1, 3):
        assert slave.ask_number(0x40 + part, ADDRESS[part]) is None
    for part in range(3):
        slave.ask_number(0x40 + part, ADDRESS[part])
    assert slave.ask_number(0x43, ADDRESS[3]) == answer(Command.SELECTED)


def test_node_id_is_pending_until_the_reset() -> None:
    slave = Slave()
    slave.configure()
    assert slave.ask(Command.CONFIGURE_NODE, 9) == answer(Command.CONFIGURE_NODE, 0)
    assert slave.ask(Command.INQUIRE_NODE) == answer(Command.INQUIRE_NODE, 5)
    slave.ask(Command.SWITCH_GLOBAL, 0)
    assert (slave.lss.node, slave.booted) == (5, 0)
    slave.lss.restart()
    assert slave.lss.node == 9


@pytest.mark.parametrize("node", [0, 128, 254])
def test_impossible_node_ids_are_refused(node: int) -> None:
    slave = Slave()
    slave.configure()
    assert slave.ask(Command.CONFIGURE_NODE, node) == answer(Command.CONFIGURE_NODE, 1)
    assert slave.lss.pending_node == 5


def test_a_node_can_be_made_unconfigured() -> None:
    slave = Slave()
    slave.configure()
    assert slave.ask(Command.CONFIGURE_NODE, 255) == answer(Command.CONFIGURE_NODE, 0)
    slave.lss.restart()
    assert slave.lss.node == UNCONFIGURED


def test_an_unconfigured_node_boots_when_it_leaves_configuration() -> None:
    slave = Slave(UNCONFIGURED)
    slave.configure()
    slave.ask(Command.CONFIGURE_NODE, 9)
    assert slave.booted == 0
    slave.ask(Command.SWITCH_GLOBAL, 0)
    assert (slave.lss.node, slave.booted) == (9, 1)


@pytest.mark.parametrize(
    "table, index, error", [(0, 2, 0), (0, 3, 0), (0, 0, 1), (0, 5, 1), (0, 9, 1), (0, 200, 1), (1, 2, 1)]
)
def test_only_bit_rates_that_the_link_can_switch_to(table: int, index: int, error: int) -> None:
    slave = Slave()
    slave.configure()
    assert slave.ask(Command.CONFIGURE_BIT_TIMING, table, index) == answer(
        Command.CONFIGURE_BIT_TIMING, error
    )


def test_bit_rate_is_activated_after_the_delay_of_the_master() -> None:
    slave = Slave()
    slave.configure()
    slave.ask(Command.CONFIGURE_BIT_TIMING, 0, 3)
    assert slave.ask(Command.ACTIVATE_BIT_TIMING, 0xE8, 0x03) is None
    assert slave.activated == [(250_000, 1.0)]


@pytest.mark.parametrize("stores, error", [(True, 0), (False, 2)])
def test_store_keeps_what_is_pending(stores: bool, error: int) -> None:
    slave = Slave(stores=stores)
    slave.configure()
    slave.ask(Command.CONFIGURE_NODE, 9)
    slave.ask(Command.CONFIGURE_BIT_TIMING, 0, 3)
    assert slave.ask(Command.STORE) == answer(Command.STORE, error)
    assert slave.stored == [(9, 250_000)]


def test_inquire_address() -> None:
    slave = Slave()
    slave.configure()
    for part, number in enumerate(ADDRESS):
        command = Command.INQUIRE_VENDOR + part
        assert slave.ask(command) == answer(command, *number.to_bytes(4, "little"))


@pytest.mark.parametrize(
    "command", [0x11, 0x13, 0x15, 0x17, 0x5A, 0x5B, 0x5C, 0x5D, 0x5E], ids=lambda command: f"{command:02X}h"
)
def test_configuration_commands_mean_nothing_in_waiting_state(command: int) -> None:
    slave = Slave()
    assert slave.ask(command, 9) is None
    assert (slave.lss.pending_node, slave.stored, slave.activated) == (5, [], [])


def _ranges(revision: tuple[int, int], serial: tuple[int, int]) -> tuple[int, ...]:
    return (IDENTITY.vendor, IDENTITY.product, *revision, *serial)


@pytest.mark.parametrize(
    "wanted, found",
    [
        (_ranges((0x1_0002, 0x1_0002), (0xCAFE_F00D, 0xCAFE_F00D)), True),
        (_ranges((0, 0xFFFF_FFFF), (0, 0xFFFF_FFFF)), True),
        (_ranges((0x1_0003, 0x1_0009), (0, 0xFFFF_FFFF)), False),
        (_ranges((0, 0xFFFF_FFFF), (0, 0xCAFE_F00C)), False),
        ((1, *_ranges((0, 0xFFFF_FFFF), (0, 0xFFFF_FFFF))[1:]), False),
    ],
)
def test_identify_remote_slave(wanted: tuple[int, ...], found: bool) -> None:
    slave = Slave()
    answers = [slave.ask_number(0x46 + part, number) for part, number in enumerate(wanted)]
    assert answers == [None] * 5 + [answer(Command.IDENTIFIED) if found else None]


@pytest.mark.parametrize("node, found", [(5, False), (UNCONFIGURED, True)])
def test_identify_non_configured(node: int, found: bool) -> None:
    assert Slave(node).ask(Command.IDENTIFY_NON_CONFIGURED) == (
        answer(Command.NON_CONFIGURED) if found else None
    )


def _scan(slave: Slave) -> tuple[int, ...] | None:
    """The master's side of fastscan: find an address bit by bit."""
    if slave.ask_number(Command.FASTSCAN, 0, 0x80, 0, 0) is None:
        return None
    found = []
    for part in range(4):
        number = 0
        for bit in range(31, -1, -1):
            if slave.ask_number(Command.FASTSCAN, number, bit, part, part) is None:
                number |= 1 << bit
        assert slave.ask_number(Command.FASTSCAN, number, 0, part, (part + 1) % 4) is not None
        found.append(number)
    return tuple(found)


def test_fastscan_finds_the_address_and_selects_the_node() -> None:
    slave = Slave(UNCONFIGURED)
    assert _scan(slave) == ADDRESS
    assert slave.lss.state is LssState.CONFIGURATION


def test_fastscan_is_for_nodes_without_node_id() -> None:
    assert _scan(Slave()) is None
    given = Slave(UNCONFIGURED)
    given.configure()
    given.ask(Command.CONFIGURE_NODE, 9)
    assert _scan(given) is None


@pytest.mark.parametrize("rest", [(32, 0, 0), (0, 4, 0), (0, 0, 4), (0, 1, 2), (255, 255, 255)])
def test_fastscan_steps_that_are_none(rest: tuple[int, int, int]) -> None:
    slave = Slave(UNCONFIGURED)
    assert slave.ask_number(Command.FASTSCAN, 0, *rest) is None


@given(
    st.sampled_from([5, UNCONFIGURED]), st.lists(st.binary(max_size=8) | st.binary(min_size=8, max_size=8))
)
def test_hostile_frames_get_at_most_one_answer_each(node: int, frames: list[bytes]) -> None:
    slave = Slave(node)
    for data in frames:
        slave.lss.receive(Frame(0x7E5, data), 0.0)
        assert len(slave.wire.take()) <= 1
        assert slave.lss.pending_node in (*range(1, 128), UNCONFIGURED)

"""The node as python-canopen's master sees it, joined to it without a bus in between."""

from __future__ import annotations

import zlib
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import canopen
import pytest
from canopen import objectdictionary

from gatewayd.canopen.frame import Frame
from gatewayd.canopen.nmt import UNCONFIGURED, NmtState
from tests.links.canopen_node.test_node import MASTER, NODE, PLAN, Plant


class Joined(canopen.Network):
    """Hands frames to a node, and what the node sends to the master at once."""

    def __init__(self, plant: Plant) -> None:
        super().__init__()
        self.plant = plant

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        self.plant.node.receive(Frame(can_id, bytes(data), remote), self.plant.now)
        self.deliver()

    def deliver(self) -> None:
        for frame in self.plant.take():
            self.notify(frame.can_id, bytearray(frame.data), self.plant.now)

    def run(self, seconds: float) -> None:
        for frame in self.plant.run(seconds):
            self.notify(frame.can_id, bytearray(frame.data), self.plant.now)


def _remote(plant: Plant) -> canopen.RemoteNode:
    """The master's picture of the node; its dictionary needs no more than what a test reads."""
    dictionary: Any = objectdictionary.ObjectDictionary()  # type: ignore[no-untyped-call]
    dictionary.node_id = NODE
    joined = Joined(plant)
    return joined.add_node(canopen.RemoteNode(NODE, dictionary))


@pytest.fixture
def plant() -> Plant:
    return Plant()


@pytest.fixture
def remote(plant: Plant) -> canopen.RemoteNode:
    return _remote(plant)


def test_nmt_state_as_the_heartbeat_tells_it(plant: Plant, remote: canopen.RemoteNode) -> None:
    plant.power_on()
    network = remote.network
    assert isinstance(network, Joined)
    network.deliver()
    for state in ("OPERATIONAL", "STOPPED", "PRE-OPERATIONAL"):
        remote.nmt.state = state
        network.run(1.0)
        assert remote.nmt.state == state


def test_sdo_of_every_kind(plant: Plant, remote: canopen.RemoteNode) -> None:
    plant.power_on()
    plant.take()
    assert remote.sdo.upload(0x1008, 0) == b"gatewayd press-3"
    assert remote.sdo.upload(0x1018, 4) == zlib.crc32(b"press-3").to_bytes(4, "little")
    remote.sdo.download(0x2001, 1, (-5).to_bytes(4, "little", signed=True))
    assert plant.cell.image.values[0] == -5
    with pytest.raises(canopen.SdoAbortedError) as caught:
        remote.sdo.download(0x1000, 0, bytes(4))
    assert caught.value.code == 0x0601_0002


def test_emergencies_and_their_end(plant: Plant, remote: canopen.RemoteNode) -> None:
    plant.operational()
    plant.heartbeat()
    network = remote.network
    assert isinstance(network, Joined)
    network.run(0.6)
    assert [error.code for error in remote.emcy.active] == [0x8130]
    assert remote.emcy.active[0].data[0] == MASTER
    network.send_message(0x700 + MASTER, b"\x05")
    assert remote.emcy.active == []


def test_sync_and_time(plant: Plant, remote: canopen.RemoteNode) -> None:
    plant.operational()
    network = remote.network
    assert isinstance(network, Joined)
    network.sync.transmit()
    network.time.transmit(datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC).timestamp())
    assert plant.node.sync.count == 1
    assert plant.notebook.times == [datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)]


def test_lss_finds_a_node_without_node_id_and_gives_it_one(monkeypatch: pytest.MonkeyPatch) -> None:
    # The master waits between its requests for slaves that are slower than this one.
    monkeypatch.setattr("canopen.lss.time.sleep", lambda _seconds: None)
    plant = Plant(replace(PLAN, node=UNCONFIGURED)).power_on()
    lss: Any = Joined(plant).lss
    lss.RESPONSE_TIMEOUT = 0.001
    found, address = lss.fast_scan()
    assert found
    lss.send_switch_state_global(lss.WAITING_STATE)
    assert lss.send_switch_state_selective(*address)
    assert lss.inquire_node_id() == UNCONFIGURED
    assert lss.inquire_lss_address(0x5D) == zlib.crc32(b"press-3")
    lss.configure_node_id(9)
    lss.configure_bit_timing(2)
    lss.store_configuration()
    lss.send_switch_state_global(lss.WAITING_STATE)
    assert plant.node.node_id == 9
    assert plant.state is NmtState.PRE_OPERATIONAL

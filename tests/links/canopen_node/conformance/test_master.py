"""python-canopen as NMT master, SDO client and LSS master of a node in its own link, over python-can's virtual bus."""

from __future__ import annotations

import io
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, cast

import canopen
import pytest

from gatewayd.canopen.nmt import UNCONFIGURED, NmtState
from gatewayd.links.canopen_node.eds import dcf_text, eds_text, objects_of, sheet_of
from gatewayd.links.canopen_node.plan import CanopenPlan
from tests.links.canopen_node.conformance.bench import MAPPING, NODE, LinkDevice, compiled

SECONDS = 5.0


def _network() -> Any:
    """A network that is quick to leave."""
    network: Any = canopen.Network()
    network.NOTIFIER_CYCLE = 0.02
    return network


class Master:
    """The device, and a network of python-canopen on its bus."""

    def __init__(self, device: LinkDevice, text: Callable[..., str] = eds_text) -> None:
        """`text` makes the file that it knows the device by."""
        self.device = device
        self.network = _network()
        self.network.connect(interface="virtual", channel=device.channel)
        plan = device.plan
        node = plan.the(CanopenPlan)
        sheet = io.StringIO(text(objects_of(node, plan.cell), sheet_of(node, plan.cell)))
        sheet.name = "dut.eds"
        self.node: Any = self.network.add_node(canopen.RemoteNode(NODE, canopen.import_od(sheet, NODE)))
        self.node.sdo.RESPONSE_TIMEOUT = SECONDS
        self.boots = 0
        self.network.subscribe(0x700 + NODE, self._error_control)

    def _error_control(self, _can_id: int, data: bytearray, _time: float) -> None:
        self.boots += data == b"\0"

    def heartbeat_tells(self, state: NmtState) -> None:
        self.until(lambda: self.node.nmt._state_received == state)

    def until(self, condition: Callable[[], object]) -> None:
        deadline = time.monotonic() + SECONDS
        while not condition():
            assert time.monotonic() < deadline
            time.sleep(0.002)

    def values(self, *names: str) -> list[Any]:
        indices = [self.device.variables[name] for name in names]
        return self.device.do(lambda _node, cell, _now: [cell.image.values[index] for index in indices])

    def robot(self, **values: Any) -> None:
        def report(_node: Any, cell: Any, now: float) -> None:
            for name, value in values.items():
                cell.image.values[self.device.variables[name]] = value
            cell.outputs_written(now)

        self.device.do(report)


@contextmanager
def running(device: LinkDevice, text: Callable[..., str] = eds_text) -> Iterator[Master]:
    made = Master(device, text)
    device.power_on()
    try:
        made.until(lambda: made.boots)
        yield made
    finally:
        made.network.disconnect()
        device.power_off()
        device.close()


@pytest.fixture
def master() -> Iterator[Master]:
    with running(LinkDevice()) as made:
        yield made


@pytest.mark.parametrize(
    "settings",
    [
        "heartbeat: 1s",
        "sync: {period: 20ms, counter: 10}",
        "sync: {producer: true, period: 20ms, counter: 10}",
        "pdo: {transmission: sync, deadline: 100ms, inhibit: 5ms}, sync: {period: 20ms}",
    ],
)
def test_the_exported_configuration_loads_without_an_abort(settings: str) -> None:
    """Each writable entry with the value of the file, by index: 1006h, and then 1019h."""
    plan = compiled(MAPPING.replace("heartbeat: none", settings))
    with running(LinkDevice(plan), dcf_text) as master:
        master.node.load_configuration()
        assert master.node.sdo[0x1006].raw == plan.the(CanopenPlan).sync.period
        assert master.node.sdo[0x1019].raw == plan.the(CanopenPlan).sync.counter


def test_master_commands_every_state_and_hears_it(master: Master) -> None:
    master.node.sdo[0x1017].raw = 10
    for name, state in (
        ("OPERATIONAL", NmtState.OPERATIONAL),
        ("STOPPED", NmtState.STOPPED),
        ("PRE-OPERATIONAL", NmtState.PRE_OPERATIONAL),
    ):
        master.node.nmt.state = name
        master.heartbeat_tells(state)
    master.node.nmt.state = "RESET"
    master.until(lambda: master.boots == 2)


def test_master_configures_pdos_and_exchanges_all_of_them(master: Master) -> None:
    """Read and save as a master does it; every variable both ways."""
    node = master.node
    node.tpdo.read()
    node.rpdo.read()
    node.tpdo[2].trans_type = 1
    node.tpdo[2].save()
    node.rpdo[3].event_timer = 0
    node.rpdo[3].save()
    heard = {number: threading.Event() for number in (1, 2, 3, 4)}
    for number, event in heard.items():
        node.tpdo[number].add_callback(lambda _map, event=event: event.set())
    node.nmt.state = "OPERATIONAL"
    for number in (1, 3, 4):
        assert heard[number].wait(SECONDS), f"TPDO {number} when OPERATIONAL is entered"
        heard[number].clear()

    master.robot(**{"bits_out[3]": True, "ints_out[0]": -5, "ints_out[3]": 7, "real_out": 2.5})
    for number in (1, 3, 4):
        assert heard[number].wait(SECONDS)
    assert not heard[2].is_set(), "it waits for SYNC"
    master.network.sync.transmit()
    assert heard[2].wait(SECONDS)
    assert [node.tpdo[1].map[bit].raw for bit in range(16)] == [bit == 3 for bit in range(16)]
    assert (node.tpdo[2].map[0].raw, node.tpdo[3].map[1].raw, node.tpdo[4].map[0].raw) == (-5, 7, 2.5)

    node.rpdo[1].map[5].raw = True
    node.rpdo[2].map[1].raw = -(2**31)
    node.rpdo[3].map[0].raw = 99
    node.rpdo[4].map[0].raw = -0.5
    for number in range(1, 5):
        node.rpdo[number].transmit()
    names = ("bits_in[5]", "ints_in[1]", "ints_in[2]", "real_in")
    master.until(lambda: master.values(*names) == [True, -(2**31), 99, -0.5])
    assert node.sdo[0x2020][1].raw == -0.5


def test_master_remaps_a_pdo(master: Master) -> None:
    node = master.node
    node.tpdo.read()
    node.tpdo[1].clear()
    node.tpdo[1].add_variable(0x2420, 1)
    node.tpdo[1].trans_type = 255
    node.tpdo[1].save()
    node.nmt.state = "OPERATIONAL"
    master.robot(real_out=8.25)
    master.until(lambda: node.tpdo[1].map[0].raw == 8.25)


def test_sdo_of_every_kind(master: Master) -> None:
    sdo = master.node.sdo
    assert sdo[0x1008].raw == "gatewayd dut"
    sdo[0x2020][1].raw = 1e300
    assert sdo[0x2020][1].raw == 1e300
    with sdo.open(0x1008, mode="rb", block_transfer=True) as file:
        assert file.read() == b"gatewayd dut"
    with sdo.open(0x2020, 1, mode="wb", block_transfer=True, size=8) as file:
        file.write(bytes.fromhex("000000000000f03f"))
    assert sdo[0x2020][1].raw == 1.0
    for index, subindex, value, code in (
        (0x2010, 5, 101, 0x0609_0031),
        (0x2010, 5, -101, 0x0609_0032),
        (0x2410, 1, 1, 0x0601_0002),
        (0x5555, 0, 1, 0x0602_0000),
        (0x2010, 99, 1, 0x0609_0011),
    ):
        with pytest.raises(canopen.SdoAbortedError) as caught:
            sdo.download(index, subindex, value.to_bytes(4, "little", signed=True))
        assert caught.value.code == code


def test_emergencies_reach_the_master(master: Master) -> None:
    node = master.node
    node.nmt.state = "OPERATIONAL"
    master.network.send_message(0x305, b"\1")
    master.until(lambda: node.emcy.log)
    assert (node.emcy.log[0].code, node.emcy.log[0].register) == (0x8210, 0x11)
    master.network.send_message(0x305, bytes(8))
    master.until(lambda: not node.emcy.active)


def test_heartbeat_of_the_master_is_watched(master: Master) -> None:
    node = master.node
    node.sdo[0x1016][1].raw = 1 << 16 | 300
    node.nmt.state = "OPERATIONAL"
    node.rpdo.read()
    node.rpdo[2].map[0].raw = 5
    node.rpdo[2].transmit()
    master.until(lambda: master.values("ints_in[0]") == [5])
    beat = master.network.send_periodic(0x701, b"\5", 0.01)
    time.sleep(0.6)
    assert node.emcy.log == []
    beat.stop()
    master.until(lambda: node.emcy.log)
    assert (node.emcy.log[0].code, node.emcy.log[0].data[0]) == (0x8130, 1)


def test_lss_master_finds_and_configures_a_node_without_node_id() -> None:
    device = LinkDevice()
    device.canopen = replace(device.canopen, node=UNCONFIGURED)
    device.power_on()
    network = _network()
    network.connect(interface="virtual", channel=device.channel)
    lss = network.lss
    lss.RESPONSE_TIMEOUT = SECONDS
    try:
        lss.send_switch_state_global(lss.CONFIGURATION_STATE)
        assert lss.inquire_node_id() == UNCONFIGURED
        address = [lss.inquire_lss_address(command) for command in range(0x5A, 0x5E)]
        lss.send_switch_state_global(lss.WAITING_STATE)
        assert lss.send_switch_state_selective(*address)
        lss.configure_node_id(NODE)
        lss.store_configuration()
        booted, no_sheet = threading.Event(), cast("Any", None)
        network.subscribe(0x700 + NODE, lambda *_: booted.set())
        lss.send_switch_state_global(lss.WAITING_STATE)
        assert booted.wait(SECONDS)
        node = network.add_node(canopen.RemoteNode(NODE, no_sheet))
        node.sdo.RESPONSE_TIMEOUT = SECONDS
        assert node.sdo.upload(0x1018, 4) == address[3].to_bytes(4, "little")
    finally:
        network.disconnect()
        device.power_off()
        device.close()

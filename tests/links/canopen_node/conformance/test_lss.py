"""LSS (CiA 305) as its master sees it; the tester has cases for it in another part than that of CiA 301."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import pytest

from gatewayd.canopen.nmt import UNCONFIGURED
from tests.links.canopen_node.conformance.bench import NODE, Device, LinkDevice, Tester, WireDevice, little

REQUEST, RESPONSE = 0x7E5, 0x7E4
QUIET = 0.03


class Lss:
    """The master's side."""

    def __init__(self, dut: Tester) -> None:
        self.dut = dut
        self.address = [dut.read(0x1018, number) for number in range(1, 5)] if dut.node == NODE else []

    def say(self, command: int, data: bytes = b"") -> None:
        self.dut.send(REQUEST, (bytes([command]) + data).ljust(8, b"\0"))

    def ask(self, command: int, data: bytes = b"") -> bytes:
        self.say(command, data)
        return self.dut.expect(RESPONSE)

    def select(self, address: list[int]) -> None:
        for command, part in zip(range(0x40, 0x44), address, strict=True):
            self.say(command, little(part, 4))


@pytest.fixture
def lss(dut: Tester) -> Lss:
    return Lss(dut)


@pytest.fixture(params=[WireDevice, LinkDevice], ids=["wire", "link"])
def nobody(request: pytest.FixtureRequest) -> Iterator[Lss]:
    """A node without node-ID: nothing is heard of it."""
    device: Device = request.param()
    device.canopen = replace(device.canopen, node=UNCONFIGURED)
    device.power_on()
    tester = Tester(device)
    tester.node = UNCONFIGURED
    try:
        assert tester.frames(QUIET) == []
        yield Lss(tester)
    finally:
        device.power_off()
        if isinstance(device, LinkDevice):
            device.close()


def test_lss_switch_global_and_inquire(lss: Lss) -> None:
    lss.say(0x5E)
    assert lss.dut.of(RESPONSE, QUIET) == [], "the node waits"
    lss.say(0x04, b"\1")
    assert lss.ask(0x5E) == bytes([0x5E, NODE]).ljust(8, b"\0")
    for command, part in zip(range(0x5A, 0x5E), lss.address, strict=True):
        assert lss.ask(command) == bytes([command]) + little(part, 4) + bytes(3)
    lss.say(0x04, b"\0")
    lss.say(0x5E)
    assert lss.dut.of(RESPONSE, QUIET) == []


def test_lss_switch_selective(lss: Lss) -> None:
    lss.select([*lss.address[:3], lss.address[3] ^ 1])
    assert lss.dut.of(RESPONSE, QUIET) == []
    lss.select(lss.address)
    assert lss.dut.expect(RESPONSE)[0] == 0x44
    assert lss.ask(0x5E)[1] == NODE


def test_lss_node_id_is_in_force_after_the_reset_and_kept_if_stored(lss: Lss) -> None:
    dut = lss.dut
    lss.say(0x04, b"\1")
    assert lss.ask(0x11, b"\x80")[1] == 1
    assert lss.ask(0x11, b"\x09") == b"\x11".ljust(8, b"\0")
    assert lss.ask(0x17) == b"\x17".ljust(8, b"\0")
    lss.say(0x04, b"\0")
    assert dut.read(0x1000) == 0
    dut.nmt(130)
    assert dut.expect(0x709) == b"\0"
    dut.device.power_off()
    dut.device.power_on()
    assert dut.expect(0x709) == b"\0"
    dut.node = 9
    assert dut.read(0x1800, 1) == 0x4000_0189
    dut.node = NODE
    dut.unanswered(bytes.fromhex("40001000"), QUIET)


def test_lss_bit_timing(lss: Lss) -> None:
    lss.say(0x04, b"\1")
    assert lss.ask(0x13, b"\0\7")[1] == (1 if lss.dut.device.exact else 0), "10 kbit/s: what the link can do"
    assert lss.ask(0x13, b"\0\2")[1] == 0, "the present one"
    assert lss.ask(0x13, b"\0\5")[1] == 1, "reserved"
    assert lss.ask(0x13, b"\1\2")[1] == 1, "another table"


def test_lss_switch_of_the_bit_rate_is_silent_for_two_delays(linked: Tester) -> None:
    lss = Lss(linked)
    linked.heartbeats(5)
    lss.say(0x04, b"\1")
    assert lss.ask(0x13, b"\0\3")[1] == 0
    lss.say(0x15, little(50, 2))
    linked.frames(0.02)
    assert linked.frames(0.05) == []
    # The bus was away for the node; it goes on when it is back.
    linked.expect(0x705)


def test_lss_identify_remote_slaves(lss: Lss) -> None:
    vendor, product, revision, serial = lss.address
    for serial_high, found in ((serial, True), (serial - 1, False)):
        parts = (vendor, product, revision, revision, 0, serial_high)
        for command, part in zip(range(0x46, 0x4C), parts, strict=True):
            lss.say(command, little(part, 4))
        if found:
            assert lss.dut.expect(RESPONSE)[0] == 0x4F
        else:
            assert lss.dut.of(RESPONSE, QUIET) == []


def test_lss_non_configured_slave_waits_and_boots(nobody: Lss) -> None:
    assert nobody.ask(0x4C)[0] == 0x50
    nobody.say(0x04, b"\1")
    assert nobody.ask(0x5E)[1] == UNCONFIGURED
    nobody.ask(0x11, b"\x07")
    nobody.say(0x04, b"\0")
    assert nobody.dut.expect(0x707) == b"\0"
    nobody.dut.node = 7
    assert nobody.dut.read(0x1400, 1) == 0x207


@pytest.mark.parametrize("nobody", [WireDevice], indirect=True)
def test_lss_fastscan(nobody: Lss) -> None:
    def step(number: int, bit: int, part: int, following: int) -> bool:
        nobody.say(0x51, little(number, 4) + bytes([bit, part, following]))
        return bool(nobody.dut.of(RESPONSE, 0))

    assert step(0, 128, 0, 0)
    found = []
    for part in range(4):
        number = 0
        for bit in range(31, -1, -1):
            if not step(number, bit, part, part):
                number |= 1 << bit
        assert step(number, 0, part, (part + 1) % 4)
        found.append(number)
    nobody.say(0x5E)
    assert nobody.dut.expect(RESPONSE)[:2] == bytes([0x5E, UNCONFIGURED])
    identity = nobody.dut.device.do(
        lambda node, _cell, _now: [node.dictionary.entry(0x1018, number).number for number in range(1, 5)]
    )
    assert found == identity

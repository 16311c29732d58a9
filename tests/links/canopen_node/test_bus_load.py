"""The worst-case load of a bus, against numbers worked out by hand and bit by bit."""

from __future__ import annotations

import random

import pytest

from gatewayd.canopen.load import Share, frame_bits, load
from gatewayd.links.canopen_node.bus_load import BIT_RATES, bus_shares
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.loader import load as load_file
from gatewayd.mapping.loader import load_together

FULL = """\
gatewayd: 1
cell: full
robot: {{host: 192.0.2.10, series: e, frequency: {frequency}}}
canopen:
  channel: can0
  bitrate: 1000000
  node: 16
  heartbeat: none
  cob_ids: {{tpdo: 0x680..0x6A0, rpdo: 0x6A1..0x6C1}}
writers: {{plc: {{canopen: rpdo, timeout: 1s}}}}
variables:
  a: {{robot: input_bit_register_0..63, canopen: auto}}
  b: {{robot: input_int_register_0..23, canopen: auto}}
  c: {{robot: input_double_register_0..23, canopen: {{type: {real}}}}}
  d: {{robot: output_bit_register_0..63, canopen: auto}}
  e: {{robot: output_int_register_0..23, canopen: auto}}
  f: {{robot: output_double_register_0..23, canopen: {{type: {real}}}}}
"""


def loaded(text: str) -> ExpandedCell:
    return load_file(text.encode(), "cell.yaml").cell


def shares(text: str) -> dict[str, Share]:
    return {share.what: share for share in bus_shares([loaded(text)])}


@pytest.mark.parametrize("length, bits", [(0, 55), (1, 65), (8, 135)])
def test_greatest_length_of_a_frame(length: int, bits: int) -> None:
    assert frame_bits(length) == bits


def crc15(bits: list[int]) -> list[int]:
    value = 0
    for bit in bits:
        feedback = bit ^ value >> 14
        value = value << 1 & 0x7FFF
        if feedback:
            value ^= 0x4599
    return [value >> shift & 1 for shift in range(14, -1, -1)]


def stuffed(bits: list[int]) -> int:
    """Length with a bit of the other kind after five equal ones; that bit counts for the next five."""
    length, run, last = 0, 0, -1
    for bit in bits:
        run = run + 1 if bit == last else 1
        last = bit
        length += 1
        if run == 5:
            last, run = 1 - bit, 1
            length += 1
    return length


def test_no_frame_is_longer_than_that() -> None:
    """Frames built bit by bit (start, identifier, control, data, CRC), at random and of the worst patterns."""
    chance = random.Random(301)
    for _ in range(2000):
        length = chance.randrange(9)
        word = chance.choice([0x00, 0xFF, 0x0F, 0xF0, 0x78, 0x87, 0xC3, 0x3C, 0x1E, 0xE1, 0xAA])
        data = [word if chance.random() < 0.8 else chance.randrange(256) for _ in range(length)]
        head = [0, *(chance.randrange(2) for _ in range(11)), 0, 0, 0]
        head += [length >> shift & 1 for shift in (3, 2, 1, 0)]
        body = head + [byte >> shift & 1 for byte in data for shift in range(7, -1, -1)]
        # Then CRC delimiter, acknowledge and its delimiter, seven bits of end and three of interframe space.
        assert stuffed(body + crc15(body)) + 13 <= frame_bits(length)


@pytest.mark.parametrize(
    "frequency, real, share",
    [
        (500, "REAL64", 5.0),
        (125, "REAL64", 1.25),
        (125, "REAL32", 0.84),
        (50, "REAL64", 0.5),
        (10, "REAL64", 0.1),
    ],
)
def test_the_full_image_as_it_is_known(frequency: int, real: str, share: float) -> None:
    """74 PDOs with REAL64, 50 with REAL32."""
    found = bus_shares([loaded(FULL.format(frequency=frequency, real=real))])
    assert load(found, 1_000_000) == pytest.approx(share, abs=0.006)
    assert load(found, 250_000) == pytest.approx(4 * load(found, 1_000_000))


ONE = """\
gatewayd: 1
cell: one
robot: {{host: 192.0.2.10, series: e, frequency: 125}}
canopen:
  channel: can0
  bitrate: 500000
  node: 16
  heartbeat: 1s
{canopen}
writers: {{plc: {{canopen: rpdo, node: 1, heartbeat: 500ms}}}}
variables:
  a: {{robot: {robot}, canopen: auto}}
"""


def rate(canopen: str, robot: str = "output_int_register_0") -> float:
    label = "TPDO 1" if robot.startswith("output") else "RPDO 1"
    return shares(ONE.format(canopen=canopen, robot=robot))[f"node 16: {label}"].rate


@pytest.mark.parametrize(
    "canopen, frames",
    [
        ("", 125),
        ("  pdo: {inhibit: 20ms}", 50),
        ("  pdo: {inhibit: 1ms}", 125),
        ("  pdo: {event: 100ms}", 125),
        ("  pdo: {event: 5ms}", 250),
        ("  pdo: {event: 5ms, inhibit: 10ms}", 100),
        ("  pdo: {transmission: sync}\n  sync: {period: 20ms}", 50),
        ("  pdo: {transmission: 5}\n  sync: {period: 20ms}", 10),
        ("  pdo: {transmission: 0}\n  sync: {period: 2ms}", 125),
        ("  pdo: {transmission: sync}\n  sync: {period: 2ms}", 500),
        ("  pdo: {transmission: 5}", 25),
    ],
)
def test_greatest_rate_of_a_tpdo(canopen: str, frames: float) -> None:
    assert rate(canopen) == pytest.approx(frames)


@pytest.mark.parametrize(
    "canopen, frames",
    [
        ("", 125),
        ("  pdo: {inhibit: 50ms}", 20),
        ("  pdo: {deadline: 1ms}", 125),
        ("  pdo: {transmission: 10}\n  sync: {period: 20ms}", 50),
    ],
)
def test_greatest_rate_of_an_rpdo(canopen: str, frames: float) -> None:
    """Its producer sends no more often than the robot takes; a synchronous one comes with each SYNC."""
    assert rate(canopen, "input_int_register_0") == pytest.approx(frames)


def test_heartbeats_and_sync_are_counted() -> None:
    found = shares(ONE.format(canopen="  sync: {period: 10ms, counter: 10}", robot="output_int_register_0"))
    assert found["SYNC"].bits == 65
    assert found["SYNC"].rate == pytest.approx(100)
    assert (found["node 16: heartbeat"].bits, found["node 16: heartbeat"].rate) == (65, 1)
    assert found["node 1: heartbeat"].rate == 4


def test_cells_on_one_bus_share_sync_and_watched_heartbeats() -> None:
    text = ONE.format(canopen="  sync: {period: 10ms}", robot="output_int_register_0")
    other = text.replace("cell: one", "cell: two").replace("node: 16", "node: 17").replace("1.10", "1.11")
    cells = [one.cell for one in load_together([("a", text.encode()), ("b", other.encode())])]
    what = [share.what for share in bus_shares(cells)]
    assert sorted(what) == sorted(
        [
            "node 16: TPDO 1",
            "node 16: heartbeat",
            "node 17: TPDO 1",
            "node 17: heartbeat",
            "SYNC",
            "node 1: heartbeat",
        ]
    )


def test_bit_rates_are_those_of_cia_301() -> None:
    assert [rate // 1000 for rate in BIT_RATES] == [10, 20, 50, 125, 250, 500, 800, 1000]


def test_status_words_are_counted() -> None:
    """A PDO of four words is as long as one of eight bytes of variables."""
    text = """\
gatewayd: 1
cell: c
robot: {host: r, series: e, frequency: 10}
canopen:
  channel: can0
  bitrate: 500000
  node: 16
  heartbeat: none
  pdos: {state: {status: [flags, robot_state, lag]}}
variables: {a: {robot: robot_mode}}
"""
    cell = load_file(text.encode(), "c.yaml").cell
    (share,) = bus_shares([cell])
    assert (share.what, share.bits, share.rate) == ("node 16: TPDO 1 (state)", frame_bits(8), 10)

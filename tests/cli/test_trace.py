"""`gatewayd trace` against a served gateway whose links are a test's hand."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from gatewayd.canopen.frame import Frame
from gatewayd.links.can_frames import packed
from gatewayd.links.contract import Passage
from gatewayd.loop import clock
from gatewayd.modbus.frames import encode
from tests.cli.conftest import Invoke, Running

ASK, ANSWER = encode(7, 1, bytes.fromhex("03 0064 0002")), encode(7, 1, bytes.fromhex("03 04 0001 0002"))
PEER, OWN = "192.0.2.7:4000", "192.0.2.1:502"

Pass = Callable[[], None]


@pytest.fixture
def passing(gateway: Running) -> Pass:
    """Has a request, its answer and a CAN frame pass as soon as somebody traces."""

    def look() -> None:
        tap_of = gateway.fixed.tap_of
        if tap_of is None:
            gateway.loop.call_later(0.01, look)
            return
        now = clock.now()
        modbus, bus = tap_of("", "modbus", "modbus"), tap_of("press", "canopen", "canopen")
        modbus(Passage(now, ASK, False, PEER, OWN, "press"))
        modbus(Passage(now, ANSWER, True, PEER, OWN, "press"))
        bus(Passage(now, packed(Frame(0x705, b"\5")), True, own="can0"))

    def begin() -> None:
        gateway.loop.call_soon_threadsafe(look)

    return begin


def test_words(passing: Pass, invoke: Invoke) -> None:
    passing()
    done = invoke("trace", "--count", "3")
    assert done.exit_code == 0
    lines = [
        line.split(" ", 1)[1] for line in done.output.splitlines() if line[:1].isdigit() and ":" in line[:3]
    ]
    assert lines == [
        f"press modbus <- {PEER}  unit 1: read holding 100-101",
        f"press modbus -> {PEER}  unit 1: holding 100-101 = 1 2",
        "press canopen -> can0  705h heartbeat of node 5: operational",
    ]
    assert "3 entries" in done.output


def test_json_has_words_and_bytes(passing: Pass, invoke: Invoke, tmp_path: Path) -> None:
    passing()
    done = invoke("trace", "--count", "3", "--format", "json", "-o", str(tmp_path / "found"))
    assert done.exit_code == 0
    found = [json.loads(line) for line in (tmp_path / "found").read_text().splitlines()]
    assert [one["out"] for one in found] == [False, True, True]
    assert found[0]["data"] == ASK.hex()
    assert found[1]["text"] == "unit 1: holding 100-101 = 1 2"


def test_candump_and_pcap_are_written_to_files(passing: Pass, invoke: Invoke, tmp_path: Path) -> None:
    for form in ("candump", "pcap"):
        passing()
        assert invoke("trace", "--count", "3", "--format", form, "-o", str(tmp_path / form)).exit_code == 0
    assert (tmp_path / "candump").read_text().endswith("can0 705#05\n")
    assert (tmp_path / "pcap").read_bytes()[:4] == b"\x0a\x0d\x0d\x0a"


def test_it_ends_after_its_time_and_leaves_nothing_in_the_links(gateway: Running, invoke: Invoke) -> None:
    done = invoke("trace", "--seconds", "1s")
    assert done.exit_code == 0
    assert "no entries" in done.output
    assert gateway.fixed.tap_of is None


@pytest.mark.parametrize(
    "options, text",
    [
        (("--link", "modbsu"), "there is no link modbsu, only modbus, robot"),
        (("--cell", "nowhere"), "there is no cell nowhere"),
    ],
)
@pytest.mark.usefixtures("gateway")
def test_what_is_not_there_is_refused(invoke: Invoke, options: tuple[str, ...], text: str) -> None:
    done = invoke("trace", *options)
    assert done.exit_code == 1
    assert text in done.output


@pytest.mark.usefixtures("gateway")
def test_a_file_that_cannot_be_written_is_one_line(invoke: Invoke) -> None:
    done = invoke("trace", "-o", "/nonexistent/file")
    assert done.exit_code == 1
    assert "/nonexistent/file" in done.output

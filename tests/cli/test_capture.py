"""Files of traffic, as the tools that they are for read them."""

from __future__ import annotations

import shutil
import struct
import subprocess
from pathlib import Path

import pytest

from gatewayd.canopen.frame import Frame
from gatewayd.cli.capture import Captured, PcapWriter, candump_line
from gatewayd.links.can_frames import packed
from gatewayd.links.contract import Medium
from gatewayd.modbus.frames import encode

NOW = 1_700_000_000.25
ASK, ANSWER = encode(7, 1, bytes.fromhex("03 0064 0002")), encode(7, 1, bytes.fromhex("03 04 0001 0002"))


def can(frame: Frame, own: str = "can0") -> Captured:
    return Captured(NOW, Medium.CAN, 0, "", own, False, packed(frame))


def modbus(
    data: bytes, outgoing: bool, peer: str = "192.0.2.7:4000", own: str = "192.0.2.1:1502"
) -> Captured:
    return Captured(NOW, Medium.TCP_SERVER, 502, peer, own, outgoing, data)


@pytest.mark.parametrize(
    "captured, line",
    [
        (can(Frame(0x185, b"\1\xab")), "(1700000000.250000) can0 185#01AB"),
        (can(Frame(0, b"")), "(1700000000.250000) can0 000#"),
        (can(Frame(0x705, remote=True, length=1)), "(1700000000.250000) can0 705#R1"),
        (can(Frame(0x80), "239.0.0.1 bus"), "(1700000000.250000) 239.0.0.1_bus 080#"),
        (modbus(ASK, False), ""),
    ],
)
def test_candump(captured: Captured, line: str) -> None:
    assert candump_line(captured) == line


def test_candump_is_what_python_can_reads(tmp_path: Path) -> None:
    from can import CanutilsLogReader

    path = tmp_path / "bus.log"
    path.write_text(candump_line(can(Frame(0x185, b"\1\xab"))) + "\n")
    (message,) = CanutilsLogReader(path)
    assert (message.arbitration_id, bytes(message.data), message.timestamp) == (0x185, b"\1\xab", NOW)


def blocks(data: bytes) -> list[tuple[int, bytes]]:
    """Type and body of each pcapng block; lengths at both ends are the same."""
    found = []
    while data:
        kind, length = struct.unpack_from("<II", data)
        assert struct.unpack_from("<I", data, length - 4) == (length,)
        assert length % 4 == 0
        found.append((kind, data[8 : length - 4]))
        data = data[length:]
    return found


def test_one_file_has_modbus_and_can_side_by_side() -> None:
    writer = PcapWriter()
    data = b"".join(map(writer.blocks, (modbus(ASK, False), can(Frame(0x185, b"\1")), modbus(ANSWER, True))))
    assert [kind for kind, _ in blocks(data)] == [0x0A0D0D0A, 1, 6, 1, 6, 6]
    interfaces = [struct.unpack_from("<H", body)[0] for kind, body in blocks(data) if kind == 1]
    assert interfaces == [1, 227]


def test_both_directions_of_a_connection_fit_each_other() -> None:
    writer = PcapWriter()
    data = b"".join(map(writer.blocks, (modbus(ASK, False), modbus(ANSWER, True), modbus(ASK, False))))
    segments = [body[20 + 14 + 20 :] for kind, body in blocks(data) if kind == 6]
    heads = [struct.unpack_from(">HHII", segment) for segment in segments]
    assert heads == [
        (4000, 502, 1, 1),
        (502, 4000, 1, 1 + len(ASK)),
        (4000, 502, 1 + len(ASK), 1 + len(ANSWER)),
    ]


@pytest.mark.parametrize(
    "peer, own",
    [("192.0.2.7:4000", "192.0.2.1:502"), ("[fe80::7]:4000", "[fe80::1]:502"), ("", "192.0.2.1:502")],
)
@pytest.mark.skipif(shutil.which("tshark") is None, reason="no tshark")
def test_wireshark_reads_it(tmp_path: Path, peer: str, own: str) -> None:
    """Modbus as Modbus, CANopen frames as CAN; no checksum is wrong, no segment is missing."""
    writer, path = PcapWriter(), tmp_path / "cell.pcapng"
    passages = [
        modbus(ASK, False, peer, own),
        modbus(ANSWER, True, peer, own),
        can(Frame(0x185, b"\1\xab")),
        Captured(NOW, Medium.TCP_CLIENT, 30004, "192.0.2.10:39004", "192.0.2.1:5000", True, bytes(3000)),
    ]
    path.write_bytes(b"".join(map(writer.blocks, passages)))
    options = ["-o", "tcp.check_checksum:TRUE", "-o", "ip.check_checksum:TRUE"]
    done = subprocess.run(
        ["tshark", "-r", path, *options, "-T", "fields", "-e", "_ws.col.Protocol", "-e", "modbus.func_code",
         "-e", "can.id", "-e", "_ws.expert.message", "-e", "_ws.col.Info"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    lines = done.stdout.splitlines()
    assert [line.split("\t")[0] for line in lines[:3]] == ["Modbus/TCP", "Modbus/TCP", "CAN"]
    assert [line.split("\t")[1] for line in lines[:2]] == ["3", "3"]
    assert "Query" in lines[0]
    assert "Response" in lines[1]
    assert "checksum" not in done.stdout.lower()
    assert "unseen" not in done.stdout.lower()

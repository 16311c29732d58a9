"""The binary format, which has no reader of the official client's own."""

from __future__ import annotations

import struct
from pathlib import Path

from gatewayd.rtde.recording import open_recording
from tests.rtde.recording.samples import HEADER, PACKAGES, RECIPE, TYPES


def test_payloads_behind_two_lines(tmp_path: Path) -> None:
    path = tmp_path / "robot_data.bin"
    path.write_bytes(f"{HEADER}\n{TYPES}\n".encode() + b"".join(map(RECIPE.pack, PACKAGES)))
    with open_recording(path) as found:
        assert found.recipe.kinds == RECIPE.kinds
        assert list(found) == list(PACKAGES)


def test_many_packages_are_read_in_blocks(tmp_path: Path) -> None:
    path = tmp_path / "robot_data.bin"
    rows = b"".join(struct.pack(">dI", number / 500, number % 5) for number in range(100_000))
    path.write_bytes(b"timestamp,runtime_state\nDOUBLE,UINT32\n" + rows + b"\n\n\n")
    with open_recording(path) as found:
        places = set()
        for number, values in enumerate(found):
            assert values == (number / 500, number % 5)
            places.add(found.position)
        assert number == 99_999
        assert len(places) > 2
        assert found.torn == f"{path}: 3 bytes at the end are no whole package and were left out"
        assert found.position == found.total

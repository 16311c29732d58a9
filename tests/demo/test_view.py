"""The live table fits its terminal; the plain lines have no control characters."""

from __future__ import annotations

import io
import time

import pytest
from click import unstyle
from rich.console import Console

from gatewayd.demo.scene import Scene
from gatewayd.demo.snapshot import Snapshot, snapshot
from gatewayd.demo.view import commands, plain, screen


@pytest.fixture
async def shot(scene: Scene, until) -> Snapshot:  # type: ignore[no-untyped-def]
    await until(lambda: scene.plc.program.order.start and scene.cell.health.packages > 0)
    await until(lambda: scene.master.sent > 0 and scene.master.rate(time.monotonic()) > 0)
    return snapshot(scene, time.monotonic())


def drawn(shot: Snapshot, width: int, height: int) -> list[str]:
    console = Console(file=io.StringIO(), width=width, height=height, force_terminal=True, no_color=True)
    pokes, _ = commands(1502, "python3")
    with console.capture() as captured:
        console.print(screen(shot, shot, pokes, width, height))
    return captured.get().splitlines()


@pytest.mark.parametrize("width,height", [(100, 30), (140, 40), (80, 24), (80, 50)])
async def test_picture_fits(shot: Snapshot, width: int, height: int) -> None:
    picture = drawn(shot, width, height)
    assert len(picture) < height
    text = "\n".join(picture)
    for line in shot.lines:
        assert line.row.name in text
    assert "operational" in text
    assert "requests/s" in text
    assert ("2030h:01" in text and "0x210" in text) is (width >= 100)
    assert ("400001.0" in text) is (width >= 115)
    assert "mbpoll -0 -p 1502 -r 10 127.0.0.1 50" in text, "how to take part, in every window"
    assert (" try: " in text) is (height < 30 or (width, height) == (80, 50))
    assert "\u2026" not in text or width > 80, "nothing is cut in the smallest one"


@pytest.mark.parametrize("width", [40, 60, 72, 80, 120])
async def test_nothing_is_cut_and_no_number_broken_at_any_width(shot: Snapshot, width: int) -> None:
    """Columns without room are named, lines are broken between words, and the height is kept."""
    picture = [unstyle(line) for line in drawn(shot, width, 24)]
    assert len(picture) <= 24
    assert max(map(len, picture)) <= width
    assert "\u2026" not in "".join(picture)
    text = " ".join("\n".join(picture).split())
    for name in ("robot register", "Modbus", "4xxxxx", "CANopen", "PDO", "age"):
        assert name in text, "as a column or in the hint"
    assert "mbpoll -0 -p 1502 -r 10 127.0.0.1 50" in text
    for line in shot.lines:
        (row,) = [drawn_line for drawn_line in picture if f" {line.row.name} " in drawn_line]
        assert f" {line.value} " in row
        assert line.quality.name.lower() in row
        assert (line.refused.rpartition(": ")[2] or line.owner or "free") in row


@pytest.mark.parametrize("width,height", [(80, 24), (80, 50), (100, 24), (100, 50)])
async def test_what_a_window_leaves_out_is_named(shot: Snapshot, width: int, height: int) -> None:
    """Columns do not vanish silently, and the links' lines end with what they have to say."""
    picture = drawn(shot, width, height)
    hint = next(line for line in picture if "wider: " in line or "In a window of 115 columns: " in line)
    assert ("4xxxxx, CANopen, PDO" if width < 98 else "4xxxxx") in hint
    assert picture[0].rstrip().endswith("refused")
    assert picture[1].rstrip().endswith("EMCY")
    for line in shot.lines:
        number = line.row["robot"].rpartition("_")[2]
        assert any(line.row.name in drawn_line and number in drawn_line for drawn_line in picture)


async def test_plain_lines_tell_the_same(shot: Snapshot) -> None:
    text = plain(shot)
    assert text.replace("\n", "").isprintable()
    for line in shot.lines:
        assert f"{line.row.name} " in text
        assert line.row["robot"] in text
        assert line.row["notation"] in text
        assert line.row["object"] in text
        assert line.row["cob_id"] in text
    assert "node operational" in text
    assert "part there" in text or "no part" in text


def test_commands_name_the_port() -> None:
    pokes, without = commands(4711, "python3")
    assert all("4711" in command for _, command in [*pokes, without])

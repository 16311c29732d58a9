"""The live table fits its terminal; the plain lines have no control characters."""

from __future__ import annotations

import io
import time

import pytest
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


@pytest.mark.parametrize("width,height", [(100, 30), (140, 40), (80, 24)])
async def test_picture_fits(shot: Snapshot, width: int, height: int) -> None:
    picture = drawn(shot, width, height)
    assert len(picture) < height
    text = "\n".join(picture)
    for line in shot.lines:
        assert line.row.name in text
    assert "operational" in text
    assert ("2030h:01" in text and "0x210" in text) is (width >= 100)
    assert ("400001.0" in text) is (width >= 115)
    assert "mbpoll -0 -p 1502 -r 10 127.0.0.1 50" in text, "how to take part, in every window"
    assert ("taller window" in text) is (height < 30)


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


def test_commands_name_the_port() -> None:
    pokes, without = commands(4711, "python3")
    assert all("4711" in command for _, command in [*pokes, without])

"""The pictures of terminals in README and tutorial have the form of what is shown today."""

from __future__ import annotations

from gatewayd.demo.scene import Scene
from gatewayd.demo.snapshot import snapshot
from gatewayd.loop import clock
from tests.docs.pictures import PAGES, WIDTH, drawn, show, shown

PICTURES = {name: lines for page in PAGES for name, lines in shown(page.read_text()).items()}


def form(lines: list[str]) -> list[list[str]]:
    """The head of the table, and of each row direction, name and register."""
    head = next(line.split() for line in lines if line.startswith("    variable"))
    return [head, *(line.split()[:3] for line in lines if line.startswith(("  → ", "  ← ")))]


async def test_the_demonstration_has_its_present_columns_and_rows() -> None:
    scene = Scene(0)
    async with scene.playing():
        present = form(drawn(snapshot(scene, clock.now())).split("\n"))
    for name in ("demo", "demo-with-you"):
        assert form(PICTURES[name]) == present, "run: python -m tests.docs.pictures"
        assert max(map(len, PICTURES[name])) <= WIDTH
    assert any("you refused: 06" in line for line in PICTURES["demo-with-you"])


def test_the_table_of_the_tutorial_is_what_show_prints() -> None:
    assert PICTURES["show"] == show()["show"].split("\n"), "run: python -m tests.docs.pictures"

"""Pictures of terminals in README and tutorial, recorded from real runs by `python -m tests.docs.pictures`.

A page holds one between `<!-- recorded: NAME -->` and `<!-- end -->`. What runs differs from time to time, so that only
its form is tested (tests/docs/test_pictures.py).
"""

from __future__ import annotations

import asyncio
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

from pymodbus.client import AsyncModbusTcpClient
from rich.console import Console

from gatewayd.demo.scene import HOST, PORT, Scene
from gatewayd.demo.snapshot import Snapshot, snapshot
from gatewayd.demo.view import commands, screen
from gatewayd.loop import clock
from tests.docs.generated import DOCS, ROOT

PAGES = (ROOT / "README.md", DOCS / "tutorial/1-demo.md", DOCS / "tutorial/2-own-mapping.md")
WIDTH, HEIGHT = 100, 31
"""A window that has room for the CANopen side."""
_PART = re.compile(r"(<!-- recorded: ([\w-]+) -->\n)(.*?)(<!-- end -->)", re.DOTALL)
_PATIENCE = 60.0


def recorded(text: str, pictures: Mapping[str, str]) -> str:
    """The text of a page with these pictures."""
    return _PART.sub(lambda found: f"{found[1]}\n```text\n{pictures[found[2]]}\n```\n\n{found[4]}", text)


def shown(text: str) -> dict[str, list[str]]:
    """The pictures in the text of a page: name -> lines."""
    return {name: part.strip().split("\n")[1:-1] for _, name, part, _ in _PART.findall(text)}


def drawn(shot: Snapshot) -> str:
    """The demonstration at one moment, without what to type."""
    console = Console(width=WIDTH, force_terminal=False, color_system=None)
    with console.capture() as captured:
        console.print(screen(shot, shot, commands(PORT, "python3")[0], WIDTH, HEIGHT))
    lines = [line.rstrip() for line in captured.get().rstrip().split("\n")]
    return "\n".join(line for line in lines if not line.startswith(" try: ")).strip("\n")


def overruled(scene: Scene) -> bool:
    """Whether the PLC has taken `feed` over and the line was refused: it waits now, and is not refused again soon."""
    picture = drawn(snapshot(scene, clock.now()))
    return "plc took feed over" in picture and "line: FF01h" in picture


async def demo() -> dict[str, str]:
    """The demonstration by itself, and while somebody takes part in it."""
    scene = Scene(PORT)
    scene.listen_to_logs()
    async with scene.playing():
        await _until(lambda: scene.plc.program.handshakes >= 4)
        alone = drawn(snapshot(scene, clock.now()))
        await _until(lambda: overruled(scene))
        async with AsyncModbusTcpClient(HOST, port=scene.port) as client:
            await client.write_register(10, 50)
            await client.write_register(1, 7)
            await asyncio.sleep(0.1)
            return {"demo": alone, "demo-with-you": drawn(snapshot(scene, clock.now()))}


def show() -> dict[str, str]:
    """The table of the mapping that the tutorial makes."""
    mapping = re.findall(r"```yaml\n(.*?)```", PAGES[2].read_text(), re.DOTALL)[0]
    with tempfile.TemporaryDirectory() as directory:
        Path(directory, "my-cell.yaml").write_text(mapping)
        output = subprocess.check_output(
            [sys.executable, "-m", "gatewayd", "show", "my-cell.yaml"],
            cwd=directory,
            env={"PYTHONPATH": str(ROOT)},
            text=True,
        )
    lines = [line.rstrip() for line in output.partition("\nwriter ")[0].split("\n")]
    return {"show": "\n".join(lines).strip("\n")}


async def _until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(_PATIENCE):
        while not condition():  # noqa: ASYNC110 - nobody tells when
            await asyncio.sleep(0.05)


def main() -> None:
    """Record all pictures, and put them in their pages."""
    with asyncio.Runner(loop_factory=clock.ClockedLoop) as runner:
        pictures = runner.run(demo()) | show()
    for page in PAGES:
        page.write_text(recorded(page.read_text(), pictures))


if __name__ == "__main__":
    main()

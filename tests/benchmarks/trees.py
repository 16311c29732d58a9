"""Whose gatewayd is measured: this tree's, and for a comparison in one run that of another checkout."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]


@dataclass(frozen=True, slots=True)
class Tree:
    """A checkout with an interpreter into which it is installed (`make dev`)."""

    name: str
    """Heads its columns."""
    root: Path
    python: str

    def command(self, *args: str | Path) -> list[str]:
        """Command line of its interpreter, which takes no module from the working directory."""
        return [self.python, "-P", *map(str, args)]

    def gatewayd(self, *args: str | Path) -> list[str]:
        """Command line of its gatewayd."""
        return self.command("-m", "gatewayd", *args)

    def check(self) -> None:
        """RuntimeError if its interpreter would run another checkout's gatewayd, or none."""
        ask = self.command("-c", "import gatewayd; print(gatewayd.__file__)")
        found = subprocess.run(ask, capture_output=True, text=True, check=False)
        if not Path(found.stdout.strip()).is_relative_to(self.root):
            where = found.stdout.strip() or "none"
            raise RuntimeError(f"{self.python} has not gatewayd of {self.root} but {where}: make dev")


HERE = Tree("gatewayd", ROOT, sys.executable)


def before(root: Path) -> Tree:
    """The checkout to compare with; its own `.venv` runs it."""
    root = root.resolve()
    return Tree("before", root, str(root / ".venv" / "bin" / "python"))


@dataclass(frozen=True, slots=True)
class Job:
    """What a subject is asked to measure."""

    seconds: float
    """Length of each measurement."""
    trees: tuple[Tree, ...] = (HERE,)
    """This tree first, then the one to compare with, if any."""

    @property
    def names(self) -> tuple[str, ...]:
        """Columns of the trees."""
        return tuple(tree.name for tree in self.trees)

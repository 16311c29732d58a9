"""The programs of docs/examples/, as parts of pages; tests/docs/test_examples.py runs them."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"
SHOWN = ("read", "record", "control-loop", "io-panel", "notebook")
"""Those that stand in a page, word for word."""


def path_of(name: str) -> Path:
    """The file of an example."""
    return EXAMPLES / f"{name.replace('-', '_')}.py"


def _shown(name: str) -> str:
    return f"```python\n{path_of(name).read_text()}```"


PARTS: dict[str, Callable[[], str]] = {f"example-{name}": partial(_shown, name) for name in SHOWN}

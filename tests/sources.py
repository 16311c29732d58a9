"""The package's own source, parsed once for all tests that read it."""

from __future__ import annotations

import ast
import gc
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "gatewayd"


def _modules() -> dict[str, Path]:
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        found[".".join(part for part in parts if part != "__init__") or "gatewayd"] = path
    return found


MODULES = _modules()
"""Module, as in `core.cell` -> its file."""


def tree(module: str) -> ast.Module:
    """The parsed source."""
    return _trees()[module]


@cache
def nodes(module: str) -> tuple[ast.AST, ...]:
    """Everything in the source."""
    return tuple(ast.walk(tree(module)))


def every_node() -> Iterator[ast.AST]:
    """Everything in the source of all modules."""
    for module in MODULES:
        yield from nodes(module)


@cache
def _trees() -> dict[str, ast.Module]:
    trees = {module: ast.parse(path.read_text()) for module, path in MODULES.items()}
    # They live as long as the tests run: no collection of garbage needs to look at half a million nodes each time.
    gc.collect()
    gc.freeze()
    return trees

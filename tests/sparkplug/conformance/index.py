"""Which test shows which statement. `python -m tests.sparkplug.conformance.index` renews the page of it."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from tests.sparkplug.conformance.cases import CHAPTERS, STATEMENTS, Statement

TESTS = Path(__file__).parents[1]
ROOT = TESTS.parents[1]
PAGE = ROOT / "docs" / "reference" / "sparkplug.md"


@cache
def shown() -> dict[str, list[str]]:
    """Statement -> what its tests show, and their file."""
    found: dict[str, list[str]] = {}
    for name, file, statements in _tests():
        for statement in statements:
            words = name.removeprefix("test_").replace("_", " ")
            found.setdefault(statement, []).append(f"{words} (`{file}`)")
    return found


def _tests() -> Iterator[tuple[str, str, list[str]]]:
    for path in sorted([*TESTS.rglob("test_*.py"), *ROOT.glob("tests/links/mqtt/test_*.py")]):
        for node in ast.parse(path.read_text()).body:
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                yield node.name, str(path.relative_to(ROOT / "tests")), list(_marks(node))


def _marks(node: ast.FunctionDef | ast.AsyncFunctionDef) -> Iterator[str]:
    for mark in node.decorator_list:
        if isinstance(mark, ast.Call) and isinstance(mark.func, ast.Name) and mark.func.id == "tck":
            yield from (str(argument.value) for argument in mark.args if isinstance(argument, ast.Constant))


def renewed(text: str) -> str:
    """The page with its table made anew."""
    for part, made in (("count", _count()), ("statements", "\n\n".join(_chapters()))):
        pattern = re.compile(rf"(<!-- {part} -->\n).*?(<!-- end -->)", re.DOTALL)
        text = pattern.sub(lambda found, made=made: f"{found[1]}\n{made}\n\n{found[2]}", text)  # type: ignore[misc]
    return text


def _count() -> str:
    skipped = sum(bool(one.why_not) for one in STATEMENTS.values())
    met = len(STATEMENTS) - skipped
    return f"Of {len(STATEMENTS)} statements **{met}** are met, **{skipped}** do not apply."


def _chapters() -> Iterator[str]:
    tests = shown()
    for title, statements in CHAPTERS.items():
        lines = [f"### {title}", "", "| id | asks | shown by |", "|---|---|---|"]
        lines += [f"| `{one.name}` | {one.asks} | {_by(one, tests)} |" for one in statements]
        yield "\n".join(lines)


def _by(one: Statement, tests: dict[str, list[str]]) -> str:
    return f"does not apply: {one.why_not}" if one.why_not else "; ".join(tests.get(one.name, []))


if __name__ == "__main__":
    PAGE.write_text(renewed(PAGE.read_text()))

"""The index of the cases: which test shows which.

`python -m tests.links.canopen_node.conformance.index` renews its page.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parents[3]
PAGE = ROOT / "docs" / "reference" / "conformance.md"

CASES = {
    "SDO": 28,
    "PDO": 33,
    "OD": 9,
    "Emergency": 6,
    "Synchronization": 10,
    "Heartbeat": 7,
    "Testing other": 10,
    "State": 4,
    "Transition": 4,
}
"""Groups of the conformance test tool, and the number of their last case."""

_NAME = re.compile(
    r"test_cct_(" + "|".join(group.lower().replace(" ", "_") for group in CASES) + r")_(\d\d)_(\w+)"
)
_GROUPS = {group.lower().replace(" ", "_"): group for group in CASES}
_PART = re.compile(r"(<!-- cases -->\n).*(<!-- end -->)", re.DOTALL)


def case_of(name: str) -> tuple[str, int, str] | None:
    """Group, number and words of the case that a test of this name shows; None if it shows none."""
    found = _NAME.fullmatch(name)
    return (_GROUPS[found[1]], int(found[2]), found[3].replace("_", " ")) if found is not None else None


def shown() -> dict[tuple[str, int], list[tuple[str, str]]]:
    """Case -> what its tests show, and their file."""
    cases: dict[tuple[str, int], list[tuple[str, str]]] = {}
    for path in sorted(HERE.glob("test_*.py")):
        for name in _tests(path):
            case = case_of(name)
            if case is not None:
                group, number, words = case
                cases.setdefault((group, number), []).append((words, path.name))
    return cases


def _tests(path: Path) -> Iterator[str]:
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.name.startswith("test_"):
            yield node.name


def renewed(text: str) -> str:
    """The page with its table made anew."""
    lines = ["| case | what is shown | by |", "|---|---|---|"]
    for (group, number), tests in sorted(
        shown().items(), key=lambda item: (list(CASES).index(item[0][0]), item[0][1])
    ):
        lines += [f"| {group} {number:02d} | {words} | `{file}` |" for words, file in tests]
    table = "\n".join(lines)
    return _PART.sub(lambda found: f"{found[1]}\n{table}\n\n{found[2]}", text)


if __name__ == "__main__":
    PAGE.write_text(renewed(PAGE.read_text()))

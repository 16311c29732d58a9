"""The index of the cases: which test shows which, and how each ends.

`python -m tests.links.canopen_node.conformance.index` renews its page.
"""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from tests.links.canopen_node.conformance.cases import CASES, Case, Result

HERE = Path(__file__).parent
ROOT = HERE.parents[3]
PAGE = ROOT / "docs" / "reference" / "conformance.md"

_CASE, _BEYOND = "test_cct_", "test_301_"
_BY_SLUG = {case.slug: case for case in CASES}
_PARTS = ("count", "cases", "beyond")

Shown = tuple[str, str]
"""What a test shows, in words, and its file."""


def case_of(name: str) -> tuple[Case, str] | None:
    """The case that a test of this name shows, and what is shown of it; None if it shows none."""
    if not name.startswith(_CASE):
        return None
    rest = name.removeprefix(_CASE)
    slug = max((slug for slug in _BY_SLUG if rest.startswith(f"{slug}_")), key=len, default=None)
    return (_BY_SLUG[slug], _words(rest.removeprefix(f"{slug}_"))) if slug is not None else None


def shown() -> dict[Case, list[Shown]]:
    """Case -> what its tests show, and their file."""
    cases: dict[Case, list[Shown]] = {}
    for name, file in _tests():
        found = case_of(name)
        if found is not None:
            cases.setdefault(found[0], []).append((found[1], file))
    return cases


def strays() -> list[str]:
    """Tests that name a case which does not exist."""
    return [name for name, _ in _tests() if name.startswith(_CASE) and case_of(name) is None]


def _tests() -> Iterator[tuple[str, str]]:
    for path in sorted(HERE.glob("test_*.py")):
        for node in ast.parse(path.read_text()).body:
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.name.startswith("test_"):
                yield node.name, path.name


def _words(name: str) -> str:
    return name.replace("_", " ")


def count() -> Counter[Result]:
    """How many cases end in which way."""
    return Counter(case.ours for case in CASES)


def renewed(text: str) -> str:
    """The page with its tables made anew."""
    for part, made in zip(_PARTS, (_count(), _cases(), _beyond()), strict=True):
        pattern = re.compile(rf"(<!-- {part} -->\n).*?(<!-- end -->)", re.DOTALL)
        text = pattern.sub(lambda found, made=made: f"{found[1]}\n{made}\n\n{found[2]}", text)  # type: ignore[misc]
    return text


def _count() -> str:
    ends = count()
    return (
        f"Of {len(CASES)} cases gatewayd passes **{ends[Result.PASSED]}**, **{ends[Result.SKIPPED]}** are skipped, "
        f"**{ends[Result.FAILED]}** fail."
    )


def _cases() -> str:
    tests = shown()
    lines = [
        "| no. | case | what it asks | in the trace | gatewayd | shown by |",
        "|---|---|---|---|---|---|",
    ]
    for case in CASES:
        ours = f"{case.ours.value}: {case.why}" if case.why else case.ours.value
        if case.ours is Result.FAILED:
            ours = f"[{ours}](#{case.slug.replace('_', '-')})"
        by = "; ".join(f"{words} (`{file}`)" for words, file in tests.get(case, []))
        lines.append(f"| {case.number} | {case.name} | {case.asks} | {case.trace.value} | {ours} | {by} |")
    return "\n".join(lines)


def _beyond() -> str:
    lines = ["| what is shown | by |", "|---|---|"]
    lines += [
        f"| {_words(name.removeprefix(_BEYOND))} | `{file}` |"
        for name, file in _tests()
        if name.startswith(_BEYOND)
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    PAGE.write_text(renewed(PAGE.read_text()))

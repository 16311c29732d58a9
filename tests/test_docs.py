"""The documentation leads somewhere: links, commands, the two commands of the README."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from gatewayd.cli import COMMANDS

ROOT = Path(__file__).parent.parent
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#+ +(.+?)\s*$", re.MULTILINE)
FENCE = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)

every_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())


def anchors(page: Path) -> set[str]:
    """What `#...` may name in the page: its headings, as forges spell them."""
    headings = HEADING.findall(FENCE.sub("", page.read_text()))
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@every_page
def test_links_lead_somewhere(page: Path) -> None:
    broken = []
    for link in LINK.findall(FENCE.sub("", page.read_text())):
        if re.match(r"[a-z]+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = page.parent / path if path else page
        if not target.exists() or (anchor and anchor not in anchors(target)):
            broken.append(link)
    assert not broken


@every_page
def test_commands_exist(page: Path) -> None:
    """Whatever a page calls as `gatewayd NAME` or `make NAME` is there."""
    text = page.read_text()
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    code = "\n".join(FENCE.findall(text) + re.findall(r"`[^`\n]+`", text))
    called = re.findall(r"(?:^|[`/$ ])gatewayd ([a-z]+)\b(?![.:=-])", code, re.MULTILINE)
    made = re.findall(r"(?:^|`)make ([a-z-]+)", code, re.MULTILINE)
    assert set(called) <= set(COMMANDS)
    assert set(made) <= targets


def test_every_promise_is_held_by_tests_that_exist() -> None:
    """Each row of the tables names its tests; a test that moves takes its row along."""
    page = (ROOT / "docs/explanation/promises.md").read_text()
    rows = [line for line in page.splitlines() if line.startswith("| ") and not line.startswith("| promise")]
    assert len(rows) > 20
    for row in rows:
        held_by = re.findall(r"`(tests/[\w/]+\.py)`", row.rsplit(" | ", 1)[1])
        assert held_by, row
        assert [name for name in held_by if not (ROOT / name).exists()] == []


def test_readme_has_exactly_two_commands() -> None:
    """One runs the main job, one passes the tests; nothing else is needed."""
    (block,) = FENCE.findall((ROOT / "README.md").read_text().split("## Two commands")[1].split("\n## ")[0])
    commands = [line.split("#")[0].strip() for line in block.splitlines()[1:-1]]
    assert commands == ["make demo", "make test"]

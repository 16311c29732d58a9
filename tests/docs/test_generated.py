"""What docs/ says of the code is what the code says: generated parts are current and all in use."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from gatewayd.links.modbus_server.functions import _FUNCTIONS
from tests.docs.generated import DOCS, PARTS, pages, renewed
from tests.sources import MODULES, nodes

every_page = pytest.mark.parametrize("page", pages(), ids=lambda page: page.relative_to(DOCS).as_posix())


@every_page
def test_page_is_current(page: Path) -> None:
    text = page.read_text()
    assert text == renewed(text), "run: python -m tests.docs"


def test_every_part_has_its_page() -> None:
    used = [
        name for page in pages() for name in re.findall(r"<!-- generated: ([\w-]+) -->", page.read_text())
    ]
    assert sorted(used) == sorted(PARTS)


def test_numbers_of_variables_in_the_guide_are_those_of_the_block() -> None:
    """The guide for PLC programmers repeats addresses; they come from the same tables."""
    reference = (DOCS / "reference" / "status-block.md").read_text()
    guide = (DOCS / "howto" / "status-block.md").read_text()
    for address in re.findall(r"\b6[0-4]\d{3}\b", guide):
        assert address in reference, f"{address} is not a word of the status block"


def test_every_page_is_found_from_the_index() -> None:
    linked = {DOCS / "README.md"}
    waiting = [DOCS / "README.md"]
    while waiting:
        page = waiting.pop()
        for link in re.findall(r"\]\(([^)#\s]+\.md)", page.read_text()):
            target = (page.parent / link).resolve()
            if target.is_relative_to(DOCS) and target.exists() and target not in linked:
                linked.add(target)
                waiting.append(target)
    assert {page for page in DOCS.rglob("*.md") if "rules" not in page.parent.parts} - linked == set()


def test_every_function_code_is_listed() -> None:
    page = (DOCS / "reference" / "modbus.md").read_text()
    table = page.split("## Function codes")[1].split("\n## ")[0]
    assert {int(code) for code in re.findall(r"^\| (\d+)", table, re.MULTILINE)} == set(_FUNCTIONS)


def test_every_text_of_the_log_is_listed() -> None:
    page = (DOCS / "reference" / "log.md").read_text()
    logged = [
        str(call.args[0].value)
        for module in MODULES
        if module.partition(".")[0] not in {"simulator", "demo"}
        for call in nodes(module)
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute)
        if call.args and isinstance(call.args[0], ast.Constant)
        if ast.unparse(call.func.value) in ("log", "_log") and call.func.attr != "log"
    ]
    assert logged
    assert [text for text in logged if f"`{text}`" not in page] == []

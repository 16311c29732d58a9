"""What others rely on is as its golden file says: see `tests/contracts.py`."""

from __future__ import annotations

import ast
import json

import pytest

from tests.contracts import CONTRACTS, GOLDEN, as_text, log_calls


@pytest.mark.parametrize("name", sorted(set(CONTRACTS) - {"log-calls"}))
def test_contract_is_kept(name: str) -> None:
    assert as_text(CONTRACTS[name]()) == (GOLDEN / f"{name}.json").read_text()


def test_log_keeps_its_texts_levels_and_fields() -> None:
    """New lines may come."""
    known: dict[str, list[str]] = json.loads((GOLDEN / "log-calls.json").read_text())
    now = log_calls()
    assert {text: now.get(text) for text in known} == known


_HELPER = """
class Part:
    async def again(self, log, period, what="internal error"):
        log.exception(what, extra=fields(part=1))
"""


@pytest.mark.parametrize(
    "calls, texts",
    [
        ("", set()),
        ("part.again(log, 2)", {"internal error"}),
        ("part.again(log, 2, 'by place'); part.again(log, 2, what='by name')", {"by place", "by name"}),
    ],
)
def test_text_handed_to_whoever_logs_it_is_followed(calls: str, texts: set[str]) -> None:
    sources = {"helper": tuple(ast.walk(ast.parse(_HELPER))), "caller": tuple(ast.walk(ast.parse(calls)))}
    assert log_calls(sources) == {text: ["exception part"] for text in texts or {"(computed in helper)"}}


def test_log_lines_of_every_form_are_found() -> None:
    found = log_calls()
    assert found["internal error, starting again"] == ["exception"]
    assert found["internal error, starting the status listener again"] == ["exception"]
    assert found["CAN bus %s"] == ["log bus cell node reason"]
    assert found["stopped before anything was served"] == ["info signal"]
    assert found["(computed in service.startup)"] == ["log at hint rule"]


def test_every_golden_file_belongs_to_a_contract() -> None:
    assert {path.stem for path in GOLDEN.iterdir()} == set(CONTRACTS)


def test_no_field_of_the_log_has_a_name_of_the_record_itself() -> None:
    """The JSON log leaves such a field out: `level` of what the controller says was that of the line."""
    calls = json.loads((GOLDEN / "log-calls.json").read_text())
    taken = {"time", "level", "logger", "event"}
    assert [
        text for text, forms in calls.items() if any(taken & set(form.split()[1:]) for form in forms)
    ] == []

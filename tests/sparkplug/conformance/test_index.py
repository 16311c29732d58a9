"""Each statement is shown by a test or says why it does not apply, and the page says which."""

from __future__ import annotations

from tests.sparkplug.conformance.cases import CHAPTERS, STATEMENTS
from tests.sparkplug.conformance.index import PAGE, renewed, shown

WANTED = (
    "payloads-ndeath-will-message",
    "payloads-ndeath-will-message-qos",
    "payloads-ndeath-will-message-retain",
    "topics-nbirth-bdseq-matching",
    "payloads-nbirth-seq",
    "payloads-nbirth-bdseq",
    "payloads-nbirth-rebirth-req",
    "payloads-name-birth-data-requirement",
    "payloads-alias-uniqueness",
    "payloads-propertyset-quality-value-value",
    "message-flow-edge-node-birth-publish-phid-wait",
    "message-flow-edge-node-birth-publish-phid-offline",
    "operational-behavior-edge-node-intentional-disconnect-ndeath",
    "principles-persistence-clean-session-311",
    "principles-persistence-clean-session-50",
)
"""Those that anybody would ask for first."""


def test_every_statement_that_applies_is_shown_and_no_other() -> None:
    tests = shown()
    assert [one.name for one in STATEMENTS.values() if bool(one.why_not) is (one.name in tests)] == []
    assert set(tests) - set(STATEMENTS) == set()


def test_no_statement_is_there_twice() -> None:
    assert len(STATEMENTS) == sum(map(len, CHAPTERS.values()))


def test_those_that_matter_most_are_there() -> None:
    assert [name for name in WANTED if name not in shown()] == []


def test_page_is_current() -> None:
    text = PAGE.read_text()
    assert text == renewed(text), "run: python -m tests.sparkplug.conformance.index"

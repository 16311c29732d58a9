"""The words for what came of a cell; most of them are pinned in test_steps.py."""

from __future__ import annotations

from gatewayd.core.refusal import Reason, Refusal
from gatewayd.maptest.actions import CellNames
from tests.maptest.written import plant


def test_says_who_owns_since_when_and_why_not() -> None:
    one = plant()
    names = CellNames(one.cell.definition)
    (lock,) = names.locks(["speed"])
    assert one.explanation.owner(lock) == "nobody has owned it"
    one.wait(1.5)
    one.take(names.writers["plc"], names.indices(["speed"]))
    assert one.explanation.owner(lock) == "owner plc since 1.5 s"
    one.release(names.writers["plc"], names.indices(["speed"]))
    assert one.explanation.owner(lock) == "free since 1.5 s: released by its owner"


def test_a_refusal_may_be_about_no_variable() -> None:
    assert plant().explanation.refusal(Refusal(Reason.WAITED)) == Reason.WAITED.text


def test_the_hint_of_a_value_names_its_policy() -> None:
    one = plant()
    names = CellNames(one.cell.definition).variables
    assert one.explanation.hint(names["part"]).endswith("`on_release`: hold")
    assert one.explanation.hint(names["light"]).endswith("`on_release`: true")
    assert one.explanation.hint(names["cycles"]).endswith("`on_stale`: hold")

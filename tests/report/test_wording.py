"""How findings name things."""

from __future__ import annotations

from gatewayd.report import wording


def test_a_name_in_another_case_is_recognised() -> None:
    """PLC programmers write PLC."""
    assert wording.did_you_mean("PLC", frozenset({"plc", "hmi"}), "no") == "did you mean `plc`?"
    assert wording.did_you_mean("xyz", ["plc", "hmi"], "no") == "no"


def test_alternatives() -> None:
    assert wording.alternatives(["a"]) == "`a`"
    assert wording.alternatives(["a", "b", "c"]) == "`a`, `b` or `c`"

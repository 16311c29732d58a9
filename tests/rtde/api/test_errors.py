"""Errors say which field, and what about it."""

from __future__ import annotations

from gatewayd.rtde.api.errors import (
    FieldsRefusedError,
    NotVerifiedError,
    RtdeError,
    TypeDifference,
    TypesDifferError,
    WriteRefusedError,
    wrong_count,
)
from gatewayd.rtde.session import Unavailable


def test_each_names_its_fields() -> None:
    refused = FieldsRefusedError([Unavailable("actual_q", True, "NOT_FOUND", "too old")])
    assert str(refused) == "actual_q: NOT_FOUND, too old"
    misspelt = FieldsRefusedError([Unavailable("actual_Q", True, "NOT_FOUND", "unknown")])
    assert "did you mean actual_q" in str(misspelt)
    differ = TypesDifferError([TypeDifference("robot_mode", "BOOL", "INT32")])
    assert str(differ) == "robot_mode was declared as BOOL, the controller has INT32"
    write = WriteRefusedError("in", {"a": "was not given"})
    assert str(write) == "nothing was sent by 'in': a: was not given"
    seen = NotVerifiedError({"a": (1, 2)}, 0.5)
    assert str(seen) == "sent, but not shown by the robot within 0.5 s: a is 2, not 1"
    assert all(isinstance(error, RtdeError) for error in (refused, differ, write, seen))


def test_a_wrong_number_of_elements_is_counted() -> None:
    assert wrong_count("actual_q", (1.0,), 6) == "actual_q takes 6 values, 1 given"

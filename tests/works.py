"""Answers that are made step by step (`gatewayd.loop.share`), made in one go."""

from __future__ import annotations

from collections.abc import Generator
from typing import TypeVar

_Result = TypeVar("_Result")


def finished(work: Generator[object, None, _Result]) -> _Result:
    """The result of the work."""
    while True:
        try:
            next(work)
        except StopIteration as result:
            return result.value  # type: ignore[no-any-return]

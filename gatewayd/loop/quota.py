"""How often something may happen before it is only counted: some at once, then one in each period."""

from __future__ import annotations

import math
from collections.abc import Hashable

MAX_SUBJECTS = 4096
"""Subjects that are counted apart at one time; further ones share a quota, so that nobody escapes it by many names."""


class Quota:
    """`burst` at once for each subject, then one every `period` seconds. `now` is any clock that does not go back."""

    def __init__(self, burst: int, period: float) -> None:
        self._slack = (burst - 1) * period
        self._period = period
        self._paid: dict[Hashable, float] = {}
        """Until when the subject has used what it may; one that is not here has used nothing."""
        self._swept = -math.inf

    def has(self, subject: Hashable, now: float) -> bool:
        """Whether the subject has something left."""
        return self._paid.get(self._known(subject, now), now) - now <= self._slack

    def take(self, subject: Hashable, now: float) -> None:
        """The subject uses one, whether it has it or not; nobody owes more than one."""
        subject = self._known(subject, now)
        paid = max(self._paid.get(subject, now), now)
        self._paid[subject] = max(paid, min(paid + self._period, now + self._slack + self._period))

    def _known(self, subject: Hashable, now: float) -> Hashable:
        if subject in self._paid or len(self._paid) < MAX_SUBJECTS:
            return subject
        if now - self._swept >= self._period:
            self._swept = now
            self._paid = {known: paid for known, paid in self._paid.items() if paid > now}
        return subject if len(self._paid) < MAX_SUBJECTS else None

from __future__ import annotations

import math
from dataclasses import asdict

from gatewayd.core.health import Health


def test_everything_counts_from_nothing_and_the_start_is_yet_to_come() -> None:
    counts = asdict(Health())
    assert not any(counts.pop("unserved").values())
    assert counts.pop("started") == math.inf
    assert not any(counts.values())

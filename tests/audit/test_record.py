from __future__ import annotations

import json
import math

import pytest

from gatewayd.audit.record import Record, plain_value, utc
from gatewayd.report.event_text import ACCEPTED, EventRecord

WALL = 1_800_000_000.0


@pytest.mark.parametrize("value, plain", [(math.nan, "nan"), (-math.inf, "-inf"), (1.5, 1.5), (True, True)])
def test_values_are_plain_json(value: float, plain: object) -> None:
    assert plain_value(value) == plain
    record = Record(WALL, 1.0, "press", EventRecord(ACCEPTED, new=value))
    assert json.loads(json.dumps(record.as_json(), allow_nan=False))["new"] == plain


def test_times_are_utc() -> None:
    assert utc(0.0) == "1970-01-01T00:00:00.000Z"

from __future__ import annotations

import pytest

from gatewayd.modbus.client.probes import ProbeBudget


@pytest.mark.parametrize("share", [0.05, 0.2])
def test_failed_probes_take_their_share_and_no_more(share: float) -> None:
    budget = ProbeBudget(share)
    now = spent = 0.0
    while now < 1000:
        now = max(now, budget.free_at) + 0.3
        spent += 0.3
        budget.spend(0.3, now)
    assert spent / now == pytest.approx(share, rel=0.02)

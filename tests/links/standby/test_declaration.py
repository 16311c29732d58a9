"""The kind, as everybody sees it."""

from __future__ import annotations

from gatewayd.links.standby.declaration import KIND
from gatewayd.report.diff import compare
from tests.links.standby.cells import pair, planned


def test_in_words() -> None:
    plan = planned("{peer: ['192.0.2.11:2930', '192.0.2.12:2930'], address: 192.0.2.50, grace: 4s}")
    found = KIND.describe(plan.links["standby"], plan.cell)
    assert found.settings == {
        "peer": "192.0.2.11:2930, 192.0.2.12:2930",
        "listen": "",
        "address": "192.0.2.50",
        "grace": "4 s",
    }
    assert found.address == "192.0.2.50"


def test_what_differs_between_the_machines_is_no_other_mapping() -> None:
    here, there = planned("{peer: '192.0.2.12:2930'}"), planned("{peer: '192.0.2.11:2930'}")
    assert here.cell.fingerprint == there.cell.fingerprint
    assert compare(here, there), "a reload notices all the same"
    assert planned("{peer: '192.0.2.12:2930', grace: 9s}").cell.fingerprint != here.cell.fingerprint
    assert planned("{peer: '192.0.2.12:2930', address: 192.0.2.9}").cell.fingerprint != here.cell.fingerprint


def test_a_reload_never_makes_it_forget_its_role() -> None:
    plan = planned()
    assert KIND.fits(pair("{peer: '192.0.2.12:2930'}"), pair(), plan.cell, plan.cell)

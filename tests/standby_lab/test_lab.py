"""A few faults in the laboratory; a hundred of them are for `python -m tests.standby_lab`."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.standby_lab.judge import packages, violations
from tests.standby_lab.lab import Lab, usable


@pytest.mark.skipif(not usable(), reason="needs root, network namespaces and keepalived")
def test_faults_are_survived_and_there_is_one_writer(tmp_path: Path) -> None:
    with Lab(tmp_path, release=1.0) as lab:
        for fault in ("crash", "switch", "power"):
            print(lab.do(fault, lab.active()))
        lab.active()
        lines = (tmp_path / "robot.jsonl").read_text().splitlines()
    assert packages(lines) > 0
    assert list(violations(lines)) == []


def test_the_judge_sees_two_writers() -> None:
    one = '[1.0, "write", "a", ["r"], ["a"]]'
    assert list(violations([one, '[2.0, "gone", "a", [], []]', '[3.0, "write", "b", ["r"], ["b"]]'])) == []
    assert len(list(violations([one, '[2.0, "write", "b", ["r"], ["b"]]']))) == 1
    assert len(list(violations(['[2.0, "write", "b", ["r"], ["a"]]']))) == 1
    again = [one, '[2.0, "write", "b", ["r"], ["b"]]', '[3.0, "write", "a", ["r"], ["a"]]']
    assert len(list(violations(again))) == 3

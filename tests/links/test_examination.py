from __future__ import annotations

from gatewayd.links.examination import Observation, Outcome, RunningCell


def test_only_what_is_to_be_mended_is_a_finding() -> None:
    assert {outcome for outcome in Outcome if outcome.is_finding} == {Outcome.WARNING, Outcome.PROBLEM}
    assert Observation.well("route", "by eth0") == Observation("route", Outcome.OK, "by eth0")


def test_the_links_of_a_running_cell_are_found_by_the_title_of_their_kind() -> None:
    status = {
        "name": "press",
        "links": [
            {"name": "robot", "title": "A"},
            {"name": "one", "title": "B"},
            {"name": "two", "title": "B"},
        ],
        "one": {"number": 1},
        "two": {"number": 2},
        "robot": {"number": 0},
    }
    cell = RunningCell("/run/s", status)
    assert cell.name == "press"
    assert [link["number"] for link in cell.links("B")] == [1, 2]
    assert list(cell.links("C")) == []


def test_an_answer_of_another_version_is_no_links() -> None:
    assert list(RunningCell("/run/s", {}).links("B")) == []
    assert list(RunningCell("/run/s", {"links": [{}]}).links("B")) == []

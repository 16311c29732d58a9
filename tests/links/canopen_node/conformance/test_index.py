"""The list of cases is whole, each is shown by a test, and its page says so."""

from __future__ import annotations

from tests.links.canopen_node.conformance.cases import CASES, Result
from tests.links.canopen_node.conformance.index import PAGE, case_of, count, renewed, shown, strays

GROUPS = {
    "EDS checker": 1,
    "SDO": 30,
    "PDO": 33,
    "OD": 9,
    "Emergency": 6,
    "Synchronization": 10,
    "Guarding": 6,
    "Heartbeat": 7,
    "Heartbeat versus guarding": 7,
    "Testing other": 10,
    "State": 4,
    "Transition": 4,
}


def test_cases_are_those_of_the_trace() -> None:
    names = ["EDS checker"] + [
        f"{group} {number:02d}"
        for group, last in GROUPS.items()
        if group != "EDS checker"
        for number in range(1, last + 1)
    ]
    assert [case.name for case in CASES] == names
    assert len({case.number for case in CASES}) == len(CASES) == 127


def test_no_case_is_without_a_test() -> None:
    assert [case.name for case in CASES if case not in shown()] == []
    assert strays() == []


def test_what_is_skipped_says_why_and_what_fails_is_explained() -> None:
    text = PAGE.read_text()
    for case in CASES:
        assert bool(case.why) == (case.ours is Result.SKIPPED), case.name
        assert (f"### {case.name}\n" in text) == (case.ours is Result.FAILED), case.name


def test_results() -> None:
    assert count() == {Result.PASSED: 115, Result.SKIPPED: 10, Result.FAILED: 2}


def test_page_is_current() -> None:
    text = PAGE.read_text()
    assert text == renewed(text), "run: python -m tests.links.canopen_node.conformance.index"


def test_names_of_tests_are_read_as_cases() -> None:
    found = case_of("test_cct_heartbeat_versus_guarding_01_both_have_their_objects")
    assert found is not None
    assert (found[0].name, found[1]) == ("Heartbeat versus guarding 01", "both have their objects")
    assert case_of("test_cct_testing_other_11_one_too_many") is None
    assert case_of("test_lss_fastscan") is None

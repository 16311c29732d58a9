"""The list of cases is whole, and its page says what is shown."""

from __future__ import annotations

from tests.links.canopen_node.conformance.index import CASES, PAGE, case_of, renewed, shown


def test_no_case_is_missing() -> None:
    wanted = {(group, number) for group, last in CASES.items() for number in range(1, last + 1)}
    assert wanted - set(shown()) == set()
    assert set(shown()) - wanted == set()


def test_page_is_current() -> None:
    text = PAGE.read_text()
    assert text == renewed(text), "run: python -m tests.links.canopen_node.conformance.index"


def test_names_of_tests_are_read_as_cases() -> None:
    assert case_of("test_cct_testing_other_10_restricted_cob_ids") == (
        "Testing other",
        10,
        "restricted cob ids",
    )
    assert case_of("test_lss_fastscan") is None

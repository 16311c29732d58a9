"""Rules and findings."""

from __future__ import annotations

import pytest

from gatewayd.mapping import diagnostics, syntax
from gatewayd.mapping.diagnostics import RETIRED, Position, Related, Severity, retired_rule_of, rule_of


def test_position_reads_as_editors_follow_it() -> None:
    """A position is printed as file:line:column."""
    assert str(Position("cells/a.yaml", 12, 3)) == "cells/a.yaml:12:3"


def test_positions_sort_by_line_and_column() -> None:
    """Findings of one file are listed from top to bottom."""
    places = [Position("a", 10, 1), Position("a", 2, 9), Position("a", 2, 1)]
    assert sorted(places) == [places[2], places[1], places[0]]


def test_finding_carries_its_rule() -> None:
    """A finding made by a rule has its severity, place, related places and hint."""
    place = Position("a.yaml", 4, 2)
    related = (Related(Position("a.yaml", 2, 2), "first given here"),)
    finding = syntax.DUPLICATE_KEY.at(place, "the key `x` is given twice", hint="remove one", related=related)
    assert (finding.rule.id, finding.severity, finding.position) == ("GW102", Severity.ERROR, place)
    assert (finding.related, finding.hint) == (related, "remove one")


def test_family_follows_from_the_id() -> None:
    """The hundreds digit of the id names the family."""
    assert syntax.YAML_SYNTAX.family == "syntax and numbers"


@pytest.mark.parametrize("name", ["GW102", "gw102", "duplicate-key", " Duplicate-Key "])
def test_rule_is_found_by_id_and_slug(name: str) -> None:
    """People type ids and slugs in any case."""
    assert rule_of(name) is syntax.DUPLICATE_KEY


def test_unknown_rule_is_none() -> None:
    """An id that was never given is not found."""
    assert rule_of("GW199") is None


@pytest.mark.parametrize(
    "rule_id,slug",
    [
        ("GW901", "new"),
        ("GW1", "new"),
        ("GW199", "Not Kebab"),
        ("GW101", "new"),
        ("GW199", "yaml-syntax"),
        ("GW307", "new"),
        ("GW199", "foreign-port"),
    ],
)
def test_malformed_used_and_retired_ids_are_refused(rule_id: str, slug: str) -> None:
    """Ids and slugs are well formed and unique, for ever."""
    with pytest.raises(ValueError, match=rule_id):
        diagnostics.declare(rule_id, slug, "summary")


@pytest.mark.parametrize("rule", RETIRED, ids=lambda rule: rule.id)
def test_retired_rules_are_found_by_id_and_slug(rule: diagnostics.RetiredRule) -> None:
    assert retired_rule_of(rule.id.lower()) is retired_rule_of(rule.slug) is rule
    assert rule_of(rule.id) is None

"""The documented fields are complete sentences' worth of contract: every one has a meaning."""

from __future__ import annotations

import pytest

from gatewayd.links.registry import kinds
from gatewayd.report.schema import documented


@pytest.mark.parametrize("name", documented())
def test_every_field_has_a_meaning(name: str) -> None:
    fields = documented()[name]
    assert fields
    assert all(field.isidentifier() and meaning for field, meaning in fields.items())


def test_every_kind_of_link_has_its_object_in_the_cell() -> None:
    assert {kind.key for kind in kinds()} <= documented()["cell"].keys()
    assert {kind.key for kind in kinds() if kind.place} <= documented()["variable"].keys()

"""The documented fields are complete sentences' worth of contract: every one has a meaning."""

from __future__ import annotations

from gatewayd.control import documented


def test_every_field_has_a_meaning() -> None:
    for name in documented.__all__:
        fields = getattr(documented, name)
        assert fields
        assert all(field.isidentifier() and meaning for field, meaning in fields.items()), name

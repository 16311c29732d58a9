"""Kinds of objections are words for scripts: each has its meaning, and none changes."""

from __future__ import annotations

from gatewayd.core.objection import MEANINGS, Objection, ObjectionKind


def test_every_kind_has_a_word_and_a_meaning() -> None:
    assert list(MEANINGS) == list(ObjectionKind)
    assert [kind for kind in ObjectionKind if not kind.isalpha()] == []
    assert f"{Objection(ObjectionKind.LEFT, 'why').kind}" == "left"

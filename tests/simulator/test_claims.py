"""Claims: one owner per field, all or nothing."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from gatewayd.simulator.claims import ControllerClaims

FIELDS = ["a", "b", "c"]


def test_a_claim_is_all_or_nothing() -> None:
    claims = ControllerClaims()
    assert claims.claim("one", ["b"]) == frozenset()
    assert claims.claim("two", ["a", "b", "c"]) == {"b"}
    assert claims.owner("a") is None
    assert claims.held("two") == ()


def test_an_owner_may_claim_again_what_it_holds() -> None:
    claims = ControllerClaims()
    claims.claim("one", ["a", "b"])
    assert claims.claim("one", ["b", "c"]) == frozenset()
    assert claims.held("one") == ("a", "b", "c")


def test_release_frees_only_the_owners_fields() -> None:
    claims = ControllerClaims()
    claims.claim("one", ["a", "b"])
    claims.claim("two", ["c"])
    claims.release("one", ["a", "c"])
    assert [claims.owner(field) for field in FIELDS] == [None, "one", "two"]
    claims.release("one")
    assert [claims.owner(field) for field in FIELDS] == [None, None, "two"]


@given(
    st.lists(
        st.tuples(st.booleans(), st.sampled_from(["one", "two"]), st.lists(st.sampled_from(FIELDS))),
        max_size=20,
    )
)
def test_a_field_never_changes_hands_without_a_release(steps: list[tuple[bool, str, list[str]]]) -> None:
    claims = ControllerClaims()
    for claim, owner, fields in steps:
        before = {field: claims.owner(field) for field in FIELDS}
        if claim:
            taken = claims.claim(owner, fields)
            assert taken == {field for field in fields if before[field] not in (None, owner)}
            granted = set(fields) if not taken else set()
            assert {f: claims.owner(f) for f in FIELDS} == {
                f: owner if f in granted else before[f] for f in FIELDS
            }
        else:
            claims.release(owner, fields)
            freed = {f for f in fields if before[f] == owner}
            assert {f: claims.owner(f) for f in FIELDS} == {
                f: None if f in freed else before[f] for f in FIELDS
            }

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.control.access import Role
from gatewayd.control.tokens import (
    MAX_GIVEN,
    MAX_TOKENS,
    RANDOM_BYTES,
    SKEW,
    TokenFileError,
    TokenSet,
    as_text,
    digest_of,
    new_token,
    parse,
)

NOW = 1_800_000_000.0
DAY = 86400.0


def made(
    name: str = "anna", role: Role = Role.OPERATOR, seed: int = 0, wall: float = NOW
) -> tuple[TokenSet, str]:
    token, text = new_token(name, role, wall, 90 * DAY, bytes([seed]) * RANDOM_BYTES)
    return TokenSet((token,)), text


def test_a_token_has_256_bits_and_the_file_has_none_of_them() -> None:
    tokens, text = made()
    assert text.startswith("gatewayd_")
    assert len(text) == len("gatewayd_") + 43
    assert text not in as_text(tokens)
    assert digest_of(text) in as_text(tokens)
    with pytest.raises(ValueError, match="32 random bytes"):
        new_token("anna", Role.VIEWER, NOW, DAY, b"few")


def test_the_right_token_is_found_and_no_other() -> None:
    tokens, text = made()
    (token,) = tokens.tokens
    assert tokens.find(text) == token
    for wrong in ("", text[:-1], f"{text}x", text.upper(), token.digest, "\udcff", "x" * (MAX_GIVEN + 1)):
        assert tokens.find(wrong) is None


def test_it_counts_from_when_it_was_made_until_its_end() -> None:
    (token,) = made()[0].tokens
    assert token.fault(NOW) == "" == token.fault(NOW - SKEW) == token.fault(token.expires - 1)
    assert token.fault(token.expires) == "the token anna expired on 2027-04-15T08:00:00Z"
    assert "the clock here is behind" in token.fault(NOW - SKEW - 1)


def test_another_token_of_the_same_name_or_role_is_another_holder() -> None:
    (token,), (other,) = (made(seed=seed)[0].tokens for seed in (0, 1))
    assert token.holder == replace(token, expires=token.expires + 1).holder
    assert len({token.holder, other.holder, replace(token, role=Role.VIEWER).holder}) == 3


def test_a_file_is_read_as_it_was_written() -> None:
    tokens = TokenSet()
    assert parse(as_text(tokens).encode()) == tokens
    for seed, role in enumerate(Role):
        tokens = tokens.with_token(made(role.title, role, seed)[0].tokens[0], NOW)
        assert parse(as_text(tokens).encode()) == tokens
    assert parse(as_text(tokens.without("operator")).encode()).named("operator") is None


def test_a_name_is_taken_until_its_token_has_ended() -> None:
    tokens, _ = made()
    (second,) = made(seed=1)[0].tokens
    with pytest.raises(TokenFileError, match="there is a token anna already"):
        tokens.with_token(second, NOW)
    assert tokens.with_token(second, NOW + 91 * DAY).tokens == (second,)
    for name in ("", "-", "a b", "ä", "x" * 33, "a\n"):
        with pytest.raises(TokenFileError, match="is no name"):
            tokens.with_token(replace(second, name=name), NOW)


def test_they_are_bounded() -> None:
    tokens = TokenSet()
    for seed in range(MAX_TOKENS):
        tokens = tokens.with_token(made(f"t{seed}", seed=seed)[0].tokens[0], NOW)
    with pytest.raises(TokenFileError, match="64 tokens are there already"):
        tokens.with_token(made("more", seed=99)[0].tokens[0], NOW)


def changed(**changes: object) -> bytes:
    entry = json.loads(as_text(made()[0]))["tokens"][0] | changes
    return json.dumps({"gatewayd_tokens": 1, "tokens": [entry]}).encode()


@pytest.mark.parametrize(
    "text, reason",
    [
        (b"", "not a file of tokens"),
        (b"c2VjcmV0IHRva2VuIG9mIHRoZSBmb3JtZXIga2luZA==", "gatewayd token create"),
        (b"\xff\xfe", "not a text file"),
        (b"{", "not JSON"),
        (b"[" * 100_000, "not a file of tokens"),
        (b'{"gatewayd_tokens": ' + b"[" * 100_000, "not JSON"),
        (b'{"gatewayd_tokens": 2, "tokens": []}', "version 1"),
        (b'{"gatewayd_tokens": 1, "tokens": [], "more": 1}', "version 1"),
        (b'{"gatewayd_tokens": 1, "tokens": {}}', "not a list"),
        (b'{"gatewayd_tokens": 1, "tokens": [1]}', "token 1: not an object"),
        (changed(more=1), "token 1: not an object with created, expires, name, role, sha256"),
        (changed(name="a b"), "`name` is no name"),
        (changed(name=["a"]), "`name` is no name"),
        (changed(role="root"), "token 1, anna: `role` is not one of viewer, operator, engineer"),
        (changed(role=["viewer"]), "`role` is not one of"),
        (changed(sha256="A" * 64), "`sha256` is not 64 hexadecimal digits"),
        (changed(sha256=None), "`sha256` is not 64 hexadecimal digits"),
        (changed(expires="soon"), "`expires` is not a time like 2026"),
        (changed(created=5), "`created` is not a time"),
    ],
)
def test_what_is_no_file_of_tokens_is_refused_with_its_place(text: bytes, reason: str) -> None:
    with pytest.raises(TokenFileError) as error:
        parse(text)
    assert reason in str(error.value)


def test_no_two_have_one_name_or_one_hash() -> None:
    first, second = (json.loads(as_text(made(seed=seed)[0]))["tokens"][0] for seed in (0, 1))
    for pair, what in (((first, second), "name"), ((first, first | {"name": "bert"}), "sha256")):
        text = json.dumps({"gatewayd_tokens": 1, "tokens": pair})
        with pytest.raises(TokenFileError, match=f"token 2: another one has the same {what}"):
            parse(text.encode())


@given(st.binary(max_size=200) | st.text(max_size=200).map(str.encode))
def test_whatever_the_bytes_are_it_is_an_error_of_ours(text: bytes) -> None:
    with pytest.raises(TokenFileError):
        parse(text)

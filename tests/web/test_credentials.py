from __future__ import annotations

import time
from pathlib import Path

import pytest

from gatewayd.control.access import Caller, Role
from gatewayd.core.cell import Cell
from gatewayd.core.definition import OPERATOR
from gatewayd.core.events import EventKind
from gatewayd.core.forcing import Holder
from gatewayd.web.credentials import Credentials, Judgement, Unidentified
from tests.web.press import CYCLES, FORCE_LIMIT, TOKEN, token, write_tokens

ANNA = token("anna", Role.ENGINEER, TOKEN)
BERT = token("bert", Role.OPERATOR, "another")
LOCK = 0
"""Of `start`, which the PLC owns."""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return write_tokens(tmp_path / "tokens", ANNA, BERT)


@pytest.fixture
def credentials(file: Path, cell: Cell) -> Credentials:
    found = Credentials(file, lambda: [cell])
    assert found.refresh()
    assert not found.refresh()
    return found


def known(credentials: Credentials, header: str | None) -> Caller | Unidentified:
    return credentials.identify(header, "192.0.2.7", time.time())


def test_a_token_says_who_asks(credentials: Credentials) -> None:
    found = known(credentials, f"Bearer {TOKEN}")
    assert isinstance(found, Caller)
    assert (found.role, found.detail) == (Role.ENGINEER, "by token anna from 192.0.2.7")
    assert isinstance(known(credentials, "bearer  another"), Caller)


@pytest.mark.parametrize(
    "header, judgement",
    [
        (None, Judgement.NONE),
        ("", Judgement.NONE),
        ("Basic YW5uYTp4", Judgement.NONE),
        (TOKEN, Judgement.NONE),
        ("Bearer", Judgement.WRONG),
        ("Bearer ", Judgement.WRONG),
        ("Bearer wrong", Judgement.WRONG),
        (f"Bearer {TOKEN} {TOKEN}", Judgement.WRONG),
        (f"Bearer {ANNA.digest}", Judgement.WRONG),
        ("Bearer \udcff\udcfe", Judgement.WRONG),
        ("Bearer " + "x" * 8000, Judgement.WRONG),
    ],
)
def test_whatever_else_is_given_is_nobody(
    credentials: Credentials, header: str | None, judgement: Judgement
) -> None:
    found = known(credentials, header)
    assert isinstance(found, Unidentified)
    assert found.judgement is judgement
    assert TOKEN not in found.text


def test_who_is_known_is_judged_again_as_the_file_is_now(credentials: Credentials, file: Path) -> None:
    anna, bert = (known(credentials, f"Bearer {text}") for text in (TOKEN, "another"))
    assert isinstance(anna, Caller)
    assert isinstance(bert, Caller)
    assert credentials.current(anna, time.time()) == anna
    assert credentials.current(anna, time.time() + 7200) is None, "it has expired"
    write_tokens(file, BERT)
    credentials.refresh()
    assert credentials.current(anna, time.time()) is None
    file.write_text("damaged")
    credentials.refresh()
    found = credentials.current(bert, time.time())
    assert found is not None
    assert found.role is Role.VIEWER
    assert "cannot read its file" in found.reduced
    write_tokens(file, BERT)
    credentials.refresh()
    assert credentials.current(found, time.time()) == bert


def test_a_file_whose_reading_fails_in_an_unforeseen_way_leaves_nobody_acting(
    credentials: Credentials, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_path: Path) -> None:
        raise RuntimeError("a defect")

    write_tokens(file, ANNA)
    monkeypatch.setattr("gatewayd.web.credentials.read_tokens", fail)
    with pytest.raises(RuntimeError):
        credentials.refresh()
    found = known(credentials, f"Bearer {TOKEN}")
    assert isinstance(found, Caller)
    assert found.role is Role.VIEWER


def test_a_revoked_token_ends_what_it_holds_and_nothing_else(
    credentials: Credentials, file: Path, cell: Cell
) -> None:
    now = time.monotonic()
    for lock, holder in ((0, ANNA.holder), (1, BERT.holder), (2, Holder("anna"))):
        cell.operator.take_lock(lock, now, holder=holder)
    assert cell.operator.force(CYCLES, 7, now, now + 60, holder=ANNA.holder) is None
    assert cell.operator.force(FORCE_LIMIT, 9.5, now, now + 60, holder=ANNA.holder) is None
    assert credentials.end_what_ended(now, time.time()) == []
    write_tokens(file, BERT)
    assert credentials.refresh()
    assert credentials.end_what_ended(now + 1, time.time()) == ["the token anna was revoked"]
    assert cell.ownership.owners == [None, OPERATOR, OPERATOR], (
        "bert took the second, a user of this machine the third"
    )
    assert cell.forcing.forces == {}
    ended = [event for event in cell.events if event.kind in (EventKind.RELEASED, EventKind.UNFORCED)]
    assert {event.detail for event in ended} == {"the token anna was revoked"}
    assert isinstance(known(credentials, f"Bearer {TOKEN}"), Unidentified)


def test_an_expired_token_does_so_too(credentials: Credentials, cell: Cell) -> None:
    now = time.monotonic()
    cell.operator.take_lock(LOCK, now, holder=ANNA.holder)
    assert credentials.end_what_ended(now, ANNA.expires - 1) == []
    (reason,) = credentials.end_what_ended(now, ANNA.expires)
    assert reason.startswith("the token anna expired on ")
    assert cell.ownership.owners[LOCK] is None
    found = credentials.identify(f"Bearer {TOKEN}", "192.0.2.7", ANNA.expires)
    assert isinstance(found, Unidentified)
    assert (found.judgement, found.text) == (Judgement.ENDED, reason)


def test_another_role_or_secret_is_another_token(credentials: Credentials, file: Path, cell: Cell) -> None:
    now = time.monotonic()
    cell.operator.take_lock(LOCK, now, holder=ANNA.holder)
    write_tokens(file, token("anna", Role.ENGINEER, "a new one"))
    credentials.refresh()
    assert credentials.end_what_ended(now, time.time()) == ["the token anna was revoked"]


def test_a_file_that_cannot_be_read_revokes_nobody_and_lets_nobody_change_anything(
    credentials: Credentials, file: Path, cell: Cell
) -> None:
    now = time.monotonic()
    cell.operator.take_lock(LOCK, now, holder=ANNA.holder)
    file.write_text(file.read_text()[:-10])
    assert credentials.refresh()
    assert f"{file}: not JSON" in credentials.fault
    assert credentials.end_what_ended(now, time.time()) == []
    found = known(credentials, f"Bearer {TOKEN}")
    assert isinstance(found, Caller)
    assert found.role is Role.VIEWER
    write_tokens(file, ANNA)
    assert credentials.refresh()
    assert credentials.fault == ""


def test_an_editor_that_saves_by_renaming_revokes_nobody(
    credentials: Credentials, file: Path, cell: Cell
) -> None:
    now = time.monotonic()
    cell.operator.take_lock(LOCK, now, holder=ANNA.holder)
    file.rename(file.with_name("backup"))
    assert credentials.refresh()
    write_tokens(file, ANNA)
    assert credentials.refresh()
    assert (credentials.fault, credentials.end_what_ended(now, time.time())) == ("", [])


def test_a_file_that_is_gone_revokes_everybody(credentials: Credentials, file: Path, cell: Cell) -> None:
    now = time.monotonic()
    cell.operator.take_lock(LOCK, now, holder=ANNA.holder)
    file.unlink()
    assert credentials.refresh()
    assert "gatewayd token create" in credentials.fault
    assert credentials.end_what_ended(now, time.time()) == [], "an editor may be about to put it back"
    assert credentials.refresh()
    assert credentials.end_what_ended(now, time.time()) == ["the token anna was revoked"]
    assert not credentials.refresh()
    assert isinstance(known(credentials, f"Bearer {TOKEN}"), Unidentified)

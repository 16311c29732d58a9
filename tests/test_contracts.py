"""What others rely on is as its golden file says: see `tests/contracts.py`."""

from __future__ import annotations

import json

import pytest

from tests.contracts import CONTRACTS, GOLDEN, as_text, log_calls, texts


@pytest.mark.parametrize("name", sorted(set(CONTRACTS) - {"log-calls"}))
def test_contract_is_kept(name: str) -> None:
    assert as_text(CONTRACTS[name]()) == (GOLDEN / f"{name}.json").read_text()


def test_log_keeps_its_texts_levels_and_fields() -> None:
    """New lines may come. Of a text that is handed to whoever logs it, only the words can be seen here."""
    known: dict[str, list[str]] = json.loads((GOLDEN / "log-calls.json").read_text())
    now = log_calls()
    assert set(known) - set(now) - texts() == set()
    assert {text: now[text] for text in known if text in now} == {
        text: known[text] for text in known if text in now
    }


def test_every_golden_file_belongs_to_a_contract() -> None:
    assert {path.stem for path in GOLDEN.iterdir()} == set(CONTRACTS)

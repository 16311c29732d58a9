"""Log lines: one per event whatever is in it, in every format."""

from __future__ import annotations

import io
import json
import logging
import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.logs.records import Format, configure, fields

log = logging.getLogger("gatewayd.tests")


@pytest.fixture(autouse=True)
def restored() -> Iterator[None]:
    """Leave logging as it was."""
    root = logging.getLogger()
    handlers, level, raising = root.handlers[:], root.level, logging.raiseExceptions
    yield
    root.handlers[:] = handlers
    root.setLevel(level)
    logging.raiseExceptions = raising


def written(form: Format, text: str, level: int = logging.INFO, **values: object) -> str:
    """What one event becomes."""
    stream = io.StringIO()
    configure(form, logging.DEBUG, stream)
    log.log(level, text, extra=fields(**values))
    return stream.getvalue()


def test_text_line_has_utc_time_level_event_and_fields(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("time.time", lambda: 1_795_338_000.123)
    monkeypatch.setattr("time.time_ns", lambda: 1_795_338_000_123_000_000)
    line = written(Format.TEXT, "robot connected", cell="press-3", host="192.0.2.10")
    assert line == "2026-11-22T09:00:00.123Z info  robot connected cell=press-3 host=192.0.2.10\n"


@pytest.mark.parametrize(
    "level, name, priority",
    [
        (logging.DEBUG, "debug", 7),
        (logging.INFO, "info ", 6),
        (logging.WARNING, "warn ", 4),
        (logging.ERROR, "error", 3),
        (logging.CRITICAL, "crit ", 2),
        (25, "info ", 6),
        (5, "debug", 7),
    ],
)
def test_levels(level: int, name: str, priority: int) -> None:
    configure(Format.TEXT, 1, text := io.StringIO())
    log.log(level, "x")
    configure(Format.JOURNAL, 1, journal := io.StringIO())
    log.log(level, "x")
    assert text.getvalue().split("Z ")[1] == f"{name} x\n"
    assert journal.getvalue() == f"<{priority}>x\n"


@pytest.mark.parametrize(
    "value, shown",
    [
        ("plain", "plain"),
        ("", '""'),
        ("two words", '"two words"'),
        ('a"b', r'"a\"b"'),
        ("a=b", '"a=b"'),
        ("a\\b", r'"a\\b"'),
        ("a\nb", r'"a\nb"'),
        ("\x1b[31m", r'"\x1b[31m"'),
        ("\u202eevil", r'"\u202eevil"'),
        ("Prüfstück", "Prüfstück"),
        (None, "null"),
        (True, "true"),
        (3, "3"),
        (0.25, "0.25"),
        (Path("cell.yaml"), "cell.yaml"),
        (Format.TEXT, "Format.TEXT"),
    ],
)
def test_logfmt_quotes_what_needs_it(value: object, shown: str) -> None:
    assert written(Format.JOURNAL, "x", value=value) == f"<6>x value={shown}\n"


def test_arguments_are_filled_into_the_text() -> None:
    configure(Format.JOURNAL, stream=(stream := io.StringIO()))
    log.warning("%d of %d", 1, 2)
    assert stream.getvalue() == "<4>1 of 2\n"


def test_json_keeps_types_and_cannot_be_overridden_by_fields() -> None:
    configure(Format.JSON, stream=(stream := io.StringIO()))
    values = fields(value=1.5, held=True, owner=None, at=Path("x"), least=float("nan"), level="fake")
    log.info("write refused", extra=values)
    line = json.loads(stream.getvalue())
    assert line.pop("time").endswith("Z")
    assert line == {
        "level": "info",
        "logger": "gatewayd.tests",
        "event": "write refused",
        "value": 1.5,
        "held": True,
        "owner": None,
        "at": "x",
        "least": "nan",
    }


@given(text=st.text(), value=st.text())
@pytest.mark.parametrize("form", [Format.TEXT, Format.JSON, Format.JOURNAL])
def test_no_text_and_no_field_breaks_its_line(form: Format, text: str, value: str) -> None:
    line = written(form, text.replace("%", "%%"), value=value)
    assert line.endswith("\n")
    assert line[:-1].isprintable()


@pytest.mark.parametrize("form", [Format.TEXT, Format.JSON, Format.JOURNAL])
def test_an_exception_is_named_with_its_place_on_the_same_line(form: Format) -> None:
    configure(form, stream=(stream := io.StringIO()))
    try:
        int("two\nlines")
    except ValueError:
        log.exception("link failed", extra=fields(link="robot"))
    line = stream.getvalue()
    assert line.count("\n") == 1
    assert "ValueError: invalid literal" in line
    assert "test_records.py:" in line
    assert "test_an_exception_is_named" in line


def test_events_below_the_level_and_chatter_of_libraries_are_dropped() -> None:
    configure(Format.JOURNAL, logging.INFO, stream := io.StringIO())
    log.debug("detail")
    logging.getLogger("pymodbus.logging").info("chatter")
    logging.getLogger("asyncio").info("chatter")
    assert stream.getvalue() == ""


def test_configuring_again_replaces() -> None:
    configure(Format.JOURNAL, stream=(first := io.StringIO()))
    configure(Format.JOURNAL, stream=(second := io.StringIO()))
    log.info("x")
    assert (first.getvalue(), second.getvalue()) == ("", "<6>x\n")


def test_auto_is_journal_only_for_the_stream_that_systemd_connected(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with (tmp_path / "stream").open("w+") as stream:
        status = os.fstat(stream.fileno())
        for variable, expected in ((f"{status.st_dev}:{status.st_ino}", "<6>x"), ("1:2", "Z info  x")):
            monkeypatch.setenv("JOURNAL_STREAM", variable)
            configure(Format.AUTO, stream=stream)
            log.info("x")
            stream.seek(0)
            assert stream.read().splitlines()[-1].endswith(expected)


def test_a_stream_that_went_away_raises_nothing() -> None:
    stream = io.StringIO()
    configure(Format.TEXT, stream=stream)
    stream.close()
    log.info("x")

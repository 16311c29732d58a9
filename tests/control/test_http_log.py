from __future__ import annotations

import logging

import pytest
from aiohttp import web
from aiohttp.http_exceptions import BadHttpMessage

from gatewayd.control.http_log import HttpLog


def test_what_is_no_request_is_counted_and_never_quoted(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.DEBUG)
    counted: list[bool] = []
    log = HttpLog(logging.getLogger("gatewayd.test"), lambda: counted.append(True))
    for error in (BadHttpMessage("Authorization: secret"), web.RequestPayloadError("secret")):
        log.error("Error handling request from %s", "192.0.2.7", exc_info=error)
        log.debug("Error handling request from %s", "192.0.2.7", exc_info=error)
    assert len(counted) == 4
    assert "secret" not in caplog.text
    assert {record.levelno for record in caplog.records} == {logging.DEBUG}


def test_a_defect_is_logged_as_it_is(caplog: pytest.LogCaptureFixture) -> None:
    HttpLog(logging.getLogger("gatewayd.test")).error("Unhandled exception", exc_info=RuntimeError("why"))
    assert "RuntimeError: why" in caplog.text
    assert caplog.records[0].levelno == logging.ERROR

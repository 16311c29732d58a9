"""What the HTTP library says of requests that are none: kept out of the log, because it quotes them, tokens included.

Anybody can send such a thing, as often as he likes, and it is no error of the gateway's.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

from aiohttp import web
from aiohttp.http_exceptions import HttpProcessingError

from gatewayd.logs.records import fields


class HttpLog(logging.LoggerAdapter[logging.Logger]):
    """A logger for aiohttp: of malformed requests `malformed` is called and no text logged, all else is as it is."""

    def __init__(self, log: logging.Logger, malformed: Callable[[], None] = lambda: None) -> None:
        super().__init__(log)
        self._malformed = malformed

    def log(self, level: int, msg: object, *args: Any, exc_info: Any = None, **further: Any) -> None:
        """Log a record, as `logging.Logger.log` does."""
        if isinstance(exc_info, HttpProcessingError | web.RequestPayloadError):
            self._malformed()
            self.logger.debug("a malformed request", extra=fields(reason=type(exc_info).__name__))
        else:
            super().log(level, msg, *args, exc_info=exc_info, **further)

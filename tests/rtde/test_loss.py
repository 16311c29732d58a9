from __future__ import annotations

import errno
import os
import socket

import pytest

from gatewayd.rtde.loss import LossReason, connect_failure, connection_failure


def failure(number: int) -> OSError:
    return OSError(number, os.strerror(number))


@pytest.mark.parametrize(
    "error, reason, words",
    [
        (failure(errno.ECONNREFUSED), LossReason.REFUSED, "booting, or its RTDE service is off"),
        (failure(errno.EHOSTUNREACH), LossReason.UNREACHABLE, "no route"),
        (failure(errno.ENETUNREACH), LossReason.UNREACHABLE, "network unreachable"),
        (failure(errno.ETIMEDOUT), LossReason.UNREACHABLE, "does not answer"),
        (TimeoutError(), LossReason.UNREACHABLE, "does not answer"),
        (socket.gaierror(socket.EAI_NONAME, "Name or service not known"), LossReason.UNRESOLVED, "not known"),
        (failure(errno.EACCES), LossReason.FAILED, "Permission denied"),
        (OSError("odd"), LossReason.FAILED, "odd"),
    ],
)
def test_a_failed_attempt_in_plain_words(error: OSError, reason: LossReason, words: str) -> None:
    loss = connect_failure(error, "robot:30004")
    assert loss.reason is reason
    assert loss.text.startswith("robot:30004: ")
    assert words in loss.text


@pytest.mark.parametrize(
    "error, reason, words",
    [
        (None, LossReason.CLOSED, "closed by the controller"),
        (failure(errno.ECONNRESET), LossReason.CLOSED, "reset by the controller"),
        (failure(errno.EPIPE), LossReason.CLOSED, "closed by the controller"),
        (failure(errno.ETIMEDOUT), LossReason.SILENT, "cable or power lost"),
        (failure(errno.EHOSTUNREACH), LossReason.UNREACHABLE, "no route"),
    ],
)
def test_the_end_of_a_connection_in_plain_words(
    error: OSError | None, reason: LossReason, words: str
) -> None:
    loss = connection_failure(error, "robot:30004")
    assert loss.reason is reason
    assert words in loss.text

"""Keys of a terminal, and the signals that end what it shows."""

from __future__ import annotations

import os
import signal

import pytest

from gatewayd.cli.terminal import ending_on_signals, keys


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_what_is_inside_and_the_former_handler_is_back(number: int) -> None:
    former = signal.getsignal(number)
    with pytest.raises(KeyboardInterrupt), ending_on_signals():
        signal.raise_signal(number)
    assert signal.getsignal(number) is former


def test_typed_keys_are_named() -> None:
    reading, writing = os.pipe()
    os.write(writing, b"a\x1b[A\x1b[6~\x1b\x7f\xc3\xa9\r")
    assert list(keys(reading, 1.0)) == ["a", "up", "pgdn", "esc", "backspace", "é", "enter"]
    assert list(keys(reading, 0.0)) == []
    os.close(writing)
    assert list(keys(reading, 1.0)) == ["\x03"]
    os.close(reading)

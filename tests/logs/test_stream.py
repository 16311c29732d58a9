"""The log's reader may do what it likes."""

from __future__ import annotations

import logging
import os
import threading
import time
from collections.abc import Iterator
from contextlib import suppress

import pytest

from gatewayd.logs.records import Format, configure
from gatewayd.logs.stream import HANGS, LogStream, log_troubles
from gatewayd.loop import clock

Pipe = tuple[int, int]


@pytest.fixture
def pipe() -> Iterator[Pipe]:
    reading, writing = os.pipe()
    yield reading, writing
    for end in (reading, writing):
        try:
            os.close(end)
        except OSError:
            continue


@pytest.fixture
def _root() -> Iterator[None]:
    root = logging.getLogger()
    handlers, level = root.handlers[:], root.level
    yield
    root.handlers[:] = handlers
    root.setLevel(level)


def fill(writing: int) -> None:
    os.set_blocking(writing, False)
    try:
        while True:
            os.write(writing, b"x" * 4096)
    except BlockingIOError:
        os.set_blocking(writing, True)


def everything(reading: int) -> str:
    found = b""
    while data := os.read(reading, 1 << 16):
        found += data
    return found.decode()


def test_lines_come_whole_and_in_order(pipe: Pipe) -> None:
    reading, writing = pipe
    stream = LogStream(writing)
    lines = [f"line {number}: grün \udcff\n" for number in range(1000)]
    for line in lines:
        stream.write(line)
    stream.close(10)
    os.close(writing)
    assert everything(reading).splitlines() == [f"line {n}: grün \\udcff" for n in range(1000)]
    assert stream.dropped == 0


def test_a_reader_that_stops_holds_up_nobody(pipe: Pipe) -> None:
    reading, writing = pipe
    fill(writing)
    stream = LogStream(writing, capacity=10)
    begin = time.monotonic()
    for _ in range(100):
        stream.write("a line\n")
    stream.close(0.1)
    assert time.monotonic() - begin < 2
    assert 89 <= stream.dropped <= 91
    os.read(reading, 1 << 20)
    stream._thread.join(10)


@pytest.mark.usefixtures("_root")
def test_what_was_lost_is_told_when_it_reads_again(pipe: Pipe) -> None:
    reading, writing = pipe
    fill(writing)
    stream = LogStream(writing, capacity=10)
    configure(Format.TEXT, stream=stream)
    for number in range(100):
        logging.getLogger("x").info("event %d", number)
    lost = stream.dropped
    found: list[str] = []
    reader = threading.Thread(target=lambda: found.append(everything(reading)))
    reader.start()
    stream.close(10)
    os.close(writing)
    reader.join(10)
    lines = [line for line in found[0].splitlines() if "x" * 100 not in line]
    assert lines[-1].endswith(f"warn  log lines lost lines={lost}")
    assert len(lines) == 100 - lost


def test_a_reader_that_is_gone_costs_its_lines_alone(pipe: Pipe) -> None:
    reading, writing = pipe
    os.close(reading)
    stream = LogStream(writing)
    stream.write("to nobody\n")
    stream.close(10)
    assert not stream._thread.is_alive()


@pytest.mark.usefixtures("_root")
def test_a_reader_that_has_stopped_is_a_trouble(pipe: Pipe) -> None:
    reading, writing = pipe
    fill(writing)
    stream = LogStream(writing)
    configure(Format.TEXT, logging.INFO, stream)
    logging.getLogger("gatewayd.test").warning("robot lost")
    end = time.monotonic() + 10
    while not stream.held_up(clock.now()):
        assert time.monotonic() < end
        time.sleep(0.001)
    assert log_troubles(clock.now()) == []
    assert log_troubles(clock.now() + 2 * HANGS) == [
        "nobody has read the log for more than 5 s: lines wait, and then are lost"
    ]
    os.set_blocking(reading, False)
    while stream.held_up(clock.now()):
        with suppress(BlockingIOError):
            os.read(reading, 1 << 16)
    assert log_troubles(clock.now() + 2 * HANGS) == []
    stream.close()

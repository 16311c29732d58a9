"""Lines wait for a slow writer, in order and bounded, and nobody waits for them."""

from __future__ import annotations

import threading
from collections.abc import Sequence

from gatewayd.loop.lines import LineThread


class Writer:
    """Keeps what it is given; fails, or stands still, as told."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.calls = 0
        self.failures = 0
        self.go = threading.Event()
        self.go.set()

    def write(self, lines: Sequence[str]) -> bool:
        self.go.wait(10)
        self.calls += 1
        if self.failures:
            self.failures -= 1
            return False
        self.lines += lines
        return True


def test_lines_come_in_order_and_what_has_no_room_is_counted() -> None:
    writer = Writer()
    writer.go.clear()
    queue = LineThread("test", 3, writer.write)
    queue.start()
    for number in range(5):
        queue.put(str(number))
    writer.go.set()
    queue.close(10)
    assert writer.lines == ["0", "1", "2"]
    assert queue.dropped == 2


def test_what_could_not_be_written_is_tried_again() -> None:
    writer = Writer()
    writer.failures = 3
    done = threading.Event()
    queue = LineThread("test", 10, writer.write, done.set, retry=0.001)
    queue.put("a")
    queue.put("b")
    queue.start()
    assert done.wait(10)
    queue.close(10)
    assert writer.lines == ["a", "b"]


def test_it_is_called_in_the_beginning_without_lines_and_again_when_something_is_put_at_the_end() -> None:
    writer, ends = Writer(), 0

    def emptied() -> None:
        nonlocal ends
        ends += 1
        if ends == 1:
            queue.put("a word more")

    queue = LineThread("test", 10, writer.write, emptied)
    queue.start()
    queue.close(10)
    assert writer.lines == ["a word more"]
    assert queue.closing


def test_closing_is_not_held_up_by_a_writer_that_hangs() -> None:
    writer = Writer()
    writer.go.clear()
    queue = LineThread("test", 10, writer.write)
    queue.start()
    queue.put("x")
    queue.close(0.01)
    assert writer.lines == []
    writer.go.set()

"""The clocks, and that time is judged before what waited: with real sockets, signals and a stopped process."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import subprocess
import sys
import textwrap
import time

import pytest

from gatewayd.loop import clock


def test_without_a_suspension_now_is_the_monotonic_clock() -> None:
    before = time.monotonic()
    assert before <= clock.now() <= time.monotonic()


def test_raw_goes_on() -> None:
    first = clock.raw()
    assert clock.raw() >= first


def hold_up(theirs: socket.socket) -> None:
    """Something comes in while the loop is busy."""
    theirs.send(b"waited")
    time.sleep(0.12)


def _run(main: object) -> None:
    with asyncio.Runner(loop_factory=clock.ClockedLoop) as runner:
        runner.run(main)  # type: ignore[arg-type]  # a coroutine


def test_the_loop_runs_on_now() -> None:
    async def main() -> None:
        loop = asyncio.get_running_loop()
        assert abs(loop.time() - clock.now()) < 0.01

    _run(main())


def test_a_gap_is_judged_before_the_socket_that_waited() -> None:
    order: list[str] = []

    async def main() -> None:
        loop = asyncio.get_running_loop()
        ours, theirs = socket.socketpair()
        served = asyncio.Event()

        def read() -> None:
            order.append(ours.recv(10).decode())
            served.set()

        clock.on_gap(lambda gap: order.append("gap" if gap.length >= 0.1 else "short"))
        loop.add_reader(ours, read)
        loop.call_soon(hold_up, theirs)
        await served.wait()
        ours.close()
        theirs.close()

    _run(main())
    assert order == ["gap", "waited"]


def test_a_gap_in_the_middle_of_a_turn_is_judged_by_the_next_callback_of_it() -> None:
    order: list[str] = []

    async def main() -> None:
        loop = asyncio.get_running_loop()
        ended = asyncio.Event()
        clock.on_gap(lambda _gap: order.append("gap"))

        def serve() -> None:
            clock.judged_now()
            order.append("served")
            ended.set()

        loop.call_soon(time.sleep, 2 * clock.GAP)
        loop.call_soon(serve)
        await ended.wait()

    _run(main())
    assert order == ["gap", "served"]
    assert clock.judged_now() == pytest.approx(clock.now(), abs=0.1), "without a loop it judges nothing"


def test_a_gap_while_another_one_is_judged_is_judged_as_well() -> None:
    gaps: list[clock.Gap] = []

    async def main() -> None:
        def stopped_again(gap: clock.Gap) -> None:
            if not gaps:
                time.sleep(3 * clock.GAP)
            gaps.append(gap)

        clock.on_gap(stopped_again)
        time.sleep(2 * clock.GAP)  # noqa: ASYNC251 - the process stands still
        clock.judged_now()

    _run(main())
    first, second = gaps
    assert first.length >= 2 * clock.GAP
    assert second.length >= 3 * clock.GAP
    assert second.since == first.until


def test_listeners_that_are_slow_are_not_called_for_ever() -> None:
    calls: list[clock.Gap] = []

    async def main() -> None:
        def slow(gap: clock.Gap) -> None:
            calls.append(gap)
            time.sleep(2 * clock.GAP)

        clock.on_gap(slow)
        time.sleep(2 * clock.GAP)  # noqa: ASYNC251 - the process stands still
        clock.judged_now()
        assert not clock.overdue()

    _run(main())
    assert 1 < len(calls) < 10


def test_a_callback_can_see_that_what_it_hands_out_was_made_before_a_gap() -> None:
    found: list[bool] = []

    async def main() -> None:
        found.append(clock.overdue())
        time.sleep(2 * clock.GAP)  # noqa: ASYNC251 - the process stands still
        found.append(clock.overdue())
        clock.judged_now()
        found.append(clock.overdue())

    _run(main())
    assert found == [False, True, False]
    assert not clock.overdue(), "without a loop it judges nothing"


def test_sleep_that_was_asked_for_is_no_gap() -> None:
    gaps: list[clock.Gap] = []

    async def main() -> None:
        clock.on_gap(gaps.append)
        await asyncio.sleep(3 * clock.GAP)

    _run(main())
    assert [gap for gap in gaps if gap.length > 4 * clock.GAP] == []


def test_another_loop_notices_nothing() -> None:
    async def main() -> None:
        clock.on_gap(lambda _gap: pytest.fail("not on this loop"))

    asyncio.run(main())


def test_a_suspended_machine_ages_everything(monkeypatch: pytest.MonkeyPatch) -> None:
    """CLOCK_MONOTONIC stands still in suspension, CLOCK_BOOTTIME does not."""
    suspension, asleep = clock._Suspension(), [0.0]
    real = clock._read
    monkeypatch.setattr(clock, "_suspension", suspension)
    monkeypatch.setattr(clock, "_read", lambda which: real(which) + asleep[0] * (which == clock._CLOCK_BOOT))
    gaps: list[clock.Gap] = []
    raw = clock.raw() - time.monotonic()

    async def main() -> None:
        loop = asyncio.get_running_loop()
        clock.on_gap(gaps.append)
        ended = asyncio.Event()
        due = loop.call_later(60.0, ended.set)
        asleep[0] = 90.0
        loop.call_soon(lambda: None)
        async with asyncio.timeout(None):
            await ended.wait()
        assert due.when() < loop.time()

    _run(main())
    assert gaps[0].length == pytest.approx(90.0, abs=1.0)
    assert clock.now() - time.monotonic() == pytest.approx(90.0, abs=0.1)
    assert clock.raw() - time.monotonic() - raw == pytest.approx(90.0, abs=0.1)


_WAITING = """
    import asyncio, sys
    from gatewayd.loop import clock

    async def main():
        loop = asyncio.get_running_loop()
        loop.add_reader(0, lambda: print(sys.stdin.readline().strip()))
        print("runs", flush=True)
        loop.call_later(0.3, print, "timer")
        loop.call_later(0.4, loop.stop)

    loop = clock.ClockedLoop()
    loop.run_until_complete(main())
    loop.run_forever()
"""


def test_what_waits_is_read_before_timers_that_are_due() -> None:
    """A stopped process gets EINTR from epoll_wait, with which Python would run the timers first."""
    child = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(_WAITING)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    assert child.stdout is not None
    assert child.stdin is not None
    assert child.stdout.readline() == "runs\n"
    child.send_signal(signal.SIGSTOP)
    os.waitid(os.P_PID, child.pid, os.WSTOPPED)
    child.stdin.write("waited\n")
    child.stdin.flush()
    stopped = time.monotonic()
    while time.monotonic() - stopped < 0.5:
        time.sleep(0.05)
    child.send_signal(signal.SIGCONT)
    said, _ = child.communicate()
    assert said.split() == ["waited", "timer"]


_CHILD = """
    import asyncio, sys
    from gatewayd.loop import clock

    async def main():
        clock.on_gap(lambda gap: print(f"{gap.length:.1f}", flush=True))
        print("runs", flush=True)
        while True:
            await asyncio.sleep(0.02)

    with asyncio.Runner(loop_factory=clock.ClockedLoop) as runner:
        runner.run(main())
"""


def test_a_stopped_process_notices_how_long() -> None:
    child = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(_CHILD)], stdout=subprocess.PIPE, text=True
    )
    try:
        assert child.stdout is not None
        assert child.stdout.readline() == "runs\n"
        child.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, child.pid, os.WSTOPPED)
        stopped = time.monotonic()
        while time.monotonic() - stopped < 0.4:
            time.sleep(0.05)
        child.send_signal(signal.SIGCONT)
        lengths = iter(child.stdout.readline, "")
        assert next(length for length in lengths if float(length) >= 0.3)
    finally:
        child.kill()
        child.communicate()

"""What is read from /proc: whose time it is, and that the machine's own files can be read."""

from __future__ import annotations

import os

from tests.benchmarks.usage import TICK, Usage, machine_times, ours, switches, usage

STAT = "cpu  100 20 30 4000 5 6 7 8 9 0\ncpu0 1 2 3 4 5 6 7 8 9 0\nctxt 12\n"
STATUS = "Name:\tgatewayd\nvoluntary_ctxt_switches:\t15\nnonvoluntary_ctxt_switches:\t4\n"


def test_time_of_processes_and_of_the_hypervisor() -> None:
    assert machine_times(STAT) == (150 * TICK, 8 * TICK)


def test_involuntary_switches_only() -> None:
    assert switches(STATUS) == 4


def test_ours_is_the_benchmark_with_its_children_and_theirs() -> None:
    processes = [(1, 0, 50.0), (20, 1, 2.0), (21, 20, 3.0), (22, 21, 4.0), (30, 1, 60.0)]
    assert ours(processes, 20) == 9.0


def test_differences_and_sums_are_of_every_figure() -> None:
    assert Usage(5, 4, 3, 2, 1) - Usage(1, 1, 1, 1, 1) == Usage(4, 3, 2, 1, 0)


def test_this_process_and_machine_can_be_read() -> None:
    before = usage(os.getpid())
    sum(range(200_000))
    used = usage(os.getpid()) - before
    assert used.wall > 0
    assert used.cpu > 0
    assert used.steal >= 0

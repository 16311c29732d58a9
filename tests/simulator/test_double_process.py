"""The process of simulated robots, when it does not do what it should."""

from __future__ import annotations

import pytest

from gatewayd.simulator.double_process import ProcessBackend, RobotProcessError
from gatewayd.simulator.fleet import RobotHost

AT = RobotHost(ports=(0,))


def test_a_process_that_ends_at_once_says_why() -> None:
    with pytest.raises(RobotProcessError, match=r"scenario\.toml:1: no robot"):
        ProcessBackend(["robot"], "", AT, None, repeat=False)


def test_a_process_that_was_ended_is_no_answer() -> None:
    backend = ProcessBackend(["robot"], "[robots.robot]\n", AT, None, repeat=False)
    assert backend.execute("quit") == "ok"
    backend._process.wait(10)
    with pytest.raises(RobotProcessError):
        backend.execute("clients")
    backend.close()


def test_a_line_is_one_command() -> None:
    backend = ProcessBackend(["robot"], "[robots.robot]\n", AT, None, repeat=False)
    assert backend.execute("text a\nquit") == "ok"
    assert backend.execute("clients") == "ok 0"
    backend.close()

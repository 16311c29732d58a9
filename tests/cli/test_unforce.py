"""`gatewayd unforce`: one, or all."""

from __future__ import annotations

import pytest

from tests.cli.conftest import Invoke, Running


@pytest.mark.usefixtures("gateway")
def test_one(invoke: Invoke) -> None:
    assert invoke("force", "cycles", "99").exit_code == 0
    assert invoke("unforce", "cycles").output == "cycles is no longer forced: 1, good\n"
    done = invoke("unforce", "cycles")
    assert (done.exit_code, done.output) == (1, "Error: cycles is not forced\n")


def test_all(gateway: Running, invoke: Invoke) -> None:
    for name in ("cycles", "limit"):
        assert invoke("force", name, "9").exit_code == 0
    done = invoke("unforce", "--all")
    assert [line.split()[0] for line in done.output.splitlines()] == ["limit", "cycles"]
    assert not gateway.cell.forcing.forces
    assert invoke("unforce", "--all").output == "nothing is forced\n"


@pytest.mark.usefixtures("gateway")
def test_neither_nor(invoke: Invoke) -> None:
    assert invoke("unforce").exit_code == 2
    assert invoke("unforce", "cycles", "--all").exit_code == 2

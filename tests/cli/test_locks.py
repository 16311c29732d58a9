"""`gatewayd locks`: who owns what, and the local operator's hand in it."""

from __future__ import annotations

import json

import pytest

from gatewayd.core.admission import Change
from gatewayd.core.definition import OPERATOR
from gatewayd.core.requester import Requester
from tests.cli.conftest import Invoke, Running
from tests.control.served import SPEED

PLC = 0
MOTION = 2


def test_the_table(gateway: Running, invoke: Invoke) -> None:
    gateway.do(lambda cell: cell.write(Requester(PLC), [Change(SPEED, 0.5)], 1.0))
    lines = invoke("locks").output.splitlines()
    assert [line.split()[0] for line in lines] == ["lock", "start", "limit", "motion"]
    assert lines[3].split("  ")[0] == "motion"
    assert "plc > hmi" in lines[3]
    assert lines[3].endswith("speed, path")


@pytest.mark.usefixtures("gateway")
def test_json(invoke: Invoke) -> None:
    assert [one["name"] for one in json.loads(invoke("locks", "--json").output)] == [
        "start",
        "limit",
        "motion",
    ]


def test_take_and_release(gateway: Running, invoke: Invoke) -> None:
    done = invoke("locks", "take", "path", "--for", "10min")
    assert done.output == "motion is the operator's for 600 s: speed, path\n"
    assert gateway.cell.ownership.owners[MOTION] == OPERATOR
    assert "operator" in invoke("locks").output
    assert invoke("locks", "release", "motion").output == "motion is free\n"
    assert gateway.cell.ownership.owners[MOTION] is None


@pytest.mark.usefixtures("gateway")
def test_what_cannot_be_done(invoke: Invoke) -> None:
    for arguments, says in (
        (("release", "motion"), "nobody owns motion"),
        (("take", "cycles"), "there is no lock cycles"),
        (("take", "motoin"), "there is no lock motoin; did you mean motion?"),
    ):
        done = invoke("locks", *arguments)
        assert (done.exit_code, done.output) == (1, f"Error: {says}\n")


@pytest.mark.usefixtures("gateway")
def test_a_time_needs_a_unit(invoke: Invoke) -> None:
    for wrong in ("10", "-5s", "0s", "soon", "1e9s"):
        done = invoke("locks", "take", "motion", "--for", wrong)
        assert done.exit_code == 2
        assert "not a duration" in done.output or "No such option" in done.output


@pytest.mark.usefixtures("gateway")
@pytest.mark.parametrize("width", [30, 60, 80])
def test_the_table_on_a_narrow_terminal(invoke: Invoke, monkeypatch: pytest.MonkeyPatch, width: int) -> None:
    """Columns stay columns, and every word of the wide table is in it."""
    monkeypatch.delenv("COLUMNS", raising=False)
    wide = invoke("locks").output
    monkeypatch.setenv("COLUMNS", str(width))
    narrow = invoke("locks").output
    assert max(map(len, narrow.splitlines())) <= max(width, 40)
    assert sorted(narrow.replace("_ ", "_").split()) == sorted(wide.split())

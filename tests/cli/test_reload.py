"""`gatewayd reload`: what it prints and its exit codes, for every answer of a gateway. The whole way: tests/e2e."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from gatewayd.audit.trail import Audit
from gatewayd.cli.reload import command
from gatewayd.control.api import Api
from gatewayd.control.endpoint import bind
from gatewayd.control.server import serving
from gatewayd.core.objection import Objection, ObjectionKind
from gatewayd.service.daemon import Daemon
from gatewayd.service.reload import CellObjection, ReloadOutcome
from gatewayd.service.reload import Result as Ended

CHANGE = "press: 1 variable added"
DETAIL = "+ more: direction output"
LEFT = CellObjection("press", Objection(ObjectionKind.LEFT, "why"))
GONE = CellObjection("press", Objection(ObjectionKind.GONE, "so"))
REFUSED = "refused, the old mapping runs on:\n"
ACCEPT_LEFT = "  --accept left: the robot would keep a value that nobody could clear any more\n"
BOTH = f"""\
{REFUSED}  press: why [left]
  press: so [gone]
{ACCEPT_LEFT}  --accept gone: many variables of a cell, or a whole cell, would be gone: is it the right file?
  --force: all of this
"""
Reloading = Callable[..., Awaitable[Result]]


@pytest.fixture
def reloading(tmp_path: Path) -> Reloading:
    """`gatewayd reload ARGS` against a control socket behind which a reload ends so."""

    async def run(outcome: ReloadOutcome | None, *args: str) -> Result:
        asked: list[frozenset[ObjectionKind]] = []

        async def reload(accept: frozenset[ObjectionKind]) -> ReloadOutcome:
            asked.append(accept)
            assert outcome is not None
            return outcome

        path = tmp_path / "control.sock"
        with bind(path) as listening:
            async with serving(
                listening,
                Api(Daemon([], Path("/nonexistent")), Audit()),
                reload if outcome is not None else None,
            ):
                done = await asyncio.to_thread(CliRunner().invoke, command, ["--socket", str(path), *args])
        given = frozenset(kind for kind in ObjectionKind if "--force" in args or kind in args)
        assert asked == ([] if outcome is None else [given])
        return done

    return run


@pytest.mark.parametrize("outcome, code, said", [
    (ReloadOutcome(Ended.UNCHANGED), 0, "nothing has changed\n"),
    (
        ReloadOutcome(Ended.UNCHANGED, ("clients: /a.crt cannot be used",)),
        0,
        "nothing has changed, but:\n  clients: /a.crt cannot be used\n",
    ),
    (ReloadOutcome(Ended.APPLIED, (), (), 0.0042, (CHANGE, DETAIL)), 0,
     f"reloaded in 4.2 ms\n  {CHANGE}\n  {DETAIL}\n"),
    (ReloadOutcome(Ended.REFUSED, ("press: why [left]",), details=(CHANGE,), objections=(LEFT,)), 1,
     f"{REFUSED}  press: why [left]\n{ACCEPT_LEFT}  {CHANGE}\n"),
    (ReloadOutcome(Ended.REFUSED, ("press: why [left]", "press: so [gone]"), objections=(LEFT, GONE)), 1,
     BOTH),
    (ReloadOutcome(Ended.FAILED, ("a.yaml:1:1: GW001 syntax: bad", "b.yaml cannot be read")), 1,
     "failed, the old mapping runs on:\n  a.yaml:1:1: GW001 syntax: bad\n  b.yaml cannot be read\n"),
])  # fmt: skip
async def test_every_ending_is_told(
    reloading: Reloading, outcome: ReloadOutcome, code: int, said: str
) -> None:
    done = await reloading(outcome)
    assert (done.exit_code, done.output) == (code, said)
    assert bool(done.stdout) == (code == 0), "what was not done is told on standard error"


async def test_force_is_passed_on(reloading: Reloading) -> None:
    assert (await reloading(ReloadOutcome(Ended.APPLIED), "--force")).exit_code == 0


async def test_each_kind_is_accepted_by_its_word(reloading: Reloading) -> None:
    for kind in ObjectionKind:
        assert (await reloading(ReloadOutcome(Ended.APPLIED), "--accept", kind.value)).exit_code == 0
    done = CliRunner().invoke(command, ["--accept", "everything"])
    assert (done.exit_code, "'weakening'" in done.stderr) == (2, True), done.stderr


async def test_json_is_the_answer(reloading: Reloading) -> None:
    done = await reloading(ReloadOutcome(Ended.REFUSED, ("why",), (CHANGE,), objections=(LEFT,)), "--json")
    assert done.exit_code == 1
    assert json.loads(done.output) == {
        "result": "refused",
        "text": "reload refused, the old mapping runs on: why (gatewayd reload --accept left applies it anyway)",
        "reasons": ["why"],
        "changes": [CHANGE],
        "objections": [{"cell": "press", "kind": "left", "text": "why"}],
        "details": [],
        "swap_ms": 0.0,
    }


async def test_a_gateway_that_cannot_reload_says_so(reloading: Reloading) -> None:
    done = await reloading(None)
    assert done.exit_code == 1
    assert "restart it" in done.stderr


def test_no_gateway_is_exit_code_2(tmp_path: Path) -> None:
    done = CliRunner().invoke(command, ["--socket", str(tmp_path / "nobody.sock")])
    assert done.exit_code == 2
    assert "nobody.sock" in done.stderr

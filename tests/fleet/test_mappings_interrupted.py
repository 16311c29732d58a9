"""systemd/examples/gatewayd-mappings killed before each call that changes something: the next run goes on.

What a machine without power loses besides is what its disk had not yet written: the script has it written (sync) before
and after each step, which cannot be shown here.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.fleet.site import Site, needs_git
from tests.fleet.stub import GATEWAYD

pytestmark = needs_git

CALLED = ("timeout", "ln", "mv", "sync", "rm", "mkdir", "gatewayd")
"""Whatever changes something; git is called by timeout."""
COUNTING = """#!/bin/sh
echo x >>"$CALLS"
[ "$(wc -l <"$CALLS")" != "${KILL_AT:-none}" ] || kill -9 0
exec PROGRAM "$@"
"""
"""Stands before a program, and kills the script's process group instead of the call with a number."""


class Interrupted(Site):
    """Whose script can be killed before any call."""

    def __init__(self, directory: Path) -> None:
        super().__init__(directory, GATEWAYD)
        (self.bin / "gatewayd").rename(self.bin / "real-gatewayd")
        self.calls = directory / "calls"
        for name in CALLED:
            real = "real-gatewayd" if name == "gatewayd" else f"/usr/bin/{name}"
            self.program(name, COUNTING.replace("PROGRAM", real))

    def run_until(self, call: int, *arguments: str) -> bool:
        """Whether it came that far, and was killed."""
        self.calls.write_text("")
        return self.run(*arguments, CALLS=str(self.calls), KILL_AT=str(call)).returncode == -9

    def finish(self, *arguments: str) -> int:
        return self.run(*arguments, CALLS="/dev/null", KILL_AT="none").returncode

    def restart_gateway(self) -> str:
        """It reads what is in place; what that is."""
        (text,) = self.files().values()
        (self.state / "running").write_text(text)
        return text

    def running(self) -> str:
        return (self.state / "running").read_text()


@pytest.fixture
def site(tmp_path: Path) -> Interrupted:
    found = Interrupted(tmp_path)
    found.commit({"press.yaml": "first\n"})
    assert found.finish() == 0
    return found


def test_a_good_change_arrives(site: Interrupted) -> None:
    """Also if the gateway is restarted while the new version is in place and nobody has asked it."""
    call, restarts, former = 1, 0, "first\n"
    while True:
        text = f"{call}\n"
        site.commit({"press.yaml": text})
        if not site.run_until(call):
            break
        assert site.files() in ({"press.yaml": former}, {"press.yaml": text}), "one whole version is in place"
        if site.running() == former != site.restart_gateway():
            restarts += 1
        assert site.finish() == 0, f"after call {call}"
        assert (site.running(), site.files()) == (text, {"press.yaml": text})
        assert not (site.state / "pending").exists()
        call, former = call + 1, text
    assert call > 25
    assert restarts > 1
    assert len(list((site.state / "versions").glob("*[0-9a-f]"))) <= 3, "the others were removed"


@pytest.mark.parametrize("kind", ["bad", "refused"])
def test_what_must_not_be_served_is_not(site: Interrupted, kind: str) -> None:
    """A refused version may be in place for as long as the gateway is asked; after the next run it is not."""
    call = 1
    site.commit({"press.yaml": f"{kind}\n"})
    while site.run_until(call):
        assert site.running() == "first\n"
        if kind == "bad":
            assert site.files() == {"press.yaml": "first\n"}
        assert site.finish() == 1
        assert (site.running(), site.files()) == ("first\n", {"press.yaml": "first\n"})
        assert not (site.state / "pending").exists()
        call += 1
    assert call > {"bad": 8, "refused": 20}[kind]


def test_a_way_back_ends_at_one_of_the_two_versions(site: Interrupted) -> None:
    call = 1
    site.commit({"press.yaml": "second\n"})
    assert site.finish() == 0
    while site.run_until(call, "back"):
        assert site.finish() in (0, 1)
        assert site.files() == {"press.yaml": site.running()}
        assert site.running() in ("first\n", "second\n")
        assert not (site.state / "pending").exists()
        call += 1
        if site.running() == "first\n":
            (site.state / "held").unlink(missing_ok=True)
            assert site.finish() == 0
    assert call > 10


def test_a_gateway_that_is_away_all_along(site: Interrupted) -> None:
    """The newest version is in place for its start, and the last accepted one is what a refusal goes back to."""
    down = site.state / "down"
    down.touch()
    for text in ("second\n", "third\n"):
        site.commit({"press.yaml": text})
        assert site.finish() == 1
        assert site.files() == {"press.yaml": text}
    site.commit({"press.yaml": "refused\n"})
    assert site.finish() == 1
    down.unlink()
    assert site.finish() == 1
    assert (site.running(), site.files()) == ("first\n", {"press.yaml": "first\n"})

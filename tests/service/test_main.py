"""Exit codes before anything is served. The rest: tests/cli/test_run.py and tests/e2e."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from gatewayd.service import assemble
from gatewayd.service import main as main_module
from gatewayd.service.compilation import CompilationError
from gatewayd.service.main import DEFECT, NOTHING_TO_RUN, STOPPED, UNREADABLE, main
from gatewayd.service.options import Options
from gatewayd.service.startup import Startup
from tests.control.served import plan

PLANS = (plan(),)


@pytest.mark.parametrize(
    "found, strict, code",
    [
        (Startup(PLANS, 0, 0), True, STOPPED),
        (Startup(PLANS, 1, 1), False, STOPPED),
        (Startup(PLANS, 0, 1), True, NOTHING_TO_RUN),
        (Startup(PLANS, 1, 0), True, NOTHING_TO_RUN),
        (Startup((), 0, 1), False, NOTHING_TO_RUN),
        (Startup((), 2, 0), False, UNREADABLE),
    ],
)
def test_what_is_served_and_what_is_not(
    monkeypatch: pytest.MonkeyPatch, found: Startup, strict: bool, code: int
) -> None:
    served: list[Startup] = []
    monkeypatch.setattr(main_module, "load_plans", lambda *_arguments: found)
    monkeypatch.setattr(assemble, "run", lambda startup, _options: served.append(startup))
    assert main(Options((Path("a.yaml"),), strict=strict)) == code
    assert served == ([found] if code == STOPPED else [])


def test_a_process_that_cannot_read_the_files_is_a_defect(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fail(*_arguments: object) -> Startup:
        raise CompilationError("it was killed")

    monkeypatch.setattr(main_module, "load_plans", fail)
    assert main(Options((Path("a.yaml"),))) == DEFECT
    assert "it was killed" in caplog.text


def test_the_process_that_reads_is_started_before_anything_that_serves_is_imported(tmp_path: Path) -> None:
    """It takes longest; whatever is imported before it begins makes every start longer."""
    program = """
import os, subprocess, sys
import gatewayd.__main__ as entry
def started(*_arguments, **_options):
    ours = {"gatewayd.core.definition", "gatewayd.links.registry", "gatewayd.logs.records"}
    heavy = {"asyncio", "json", "pickle", "click", "logging", "pathlib"} | ours
    print(*sorted(heavy & sys.modules.keys()), flush=True)
    os._exit(7)
subprocess.Popen = started
sys.argv = ["gatewayd", "run", "cell.yaml"]
entry.main()
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert (done.returncode, done.stdout.split()) == (7, [])


@pytest.mark.parametrize("arguments", [["run", "--help"], ["run"], ["run", "--no-such-option", "cell.yaml"]])
def test_a_command_that_reads_nothing_leaves_no_process_behind(arguments: list[str], tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "gatewayd", *arguments],
        capture_output=True,
        check=False,
        cwd=tmp_path,
        timeout=20,
    )
    assert done.returncode == (0 if "--help" in arguments else 2)

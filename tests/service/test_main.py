"""Exit codes before anything is served. The rest: tests/cli/test_run.py and tests/e2e."""

from __future__ import annotations

from collections.abc import Callable, Sequence
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
    def fail(
        _files: Sequence[Path], _meanwhile: Callable[[], None], _given_up: Callable[[], bool]
    ) -> Startup:
        raise CompilationError("it was killed")

    monkeypatch.setattr(main_module, "load_plans", fail)
    assert main(Options((Path("a.yaml"),))) == DEFECT
    assert "it was killed" in caplog.text

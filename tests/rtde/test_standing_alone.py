"""`gatewayd.rtde` is a library of its own: what importing it loads, and what it does not."""

from __future__ import annotations

import subprocess
import sys

import pytest

from gatewayd import rtde

FOREIGN = ("yaml", "ruamel", "click", "pydantic", "aiohttp", "pymodbus", "can", "canopen", "rich", "numpy")


def loaded(*statements: str) -> set[str]:
    """The modules of a fresh process after these statements."""
    script = "; ".join((*statements, "import sys", "print(*sys.modules)"))
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_the_whole_api_loads_no_foreign_library() -> None:
    modules = loaded("from gatewayd import rtde", "[getattr(rtde, name) for name in rtde.__all__]")
    assert "gatewayd.rtde.client" in modules
    assert modules.isdisjoint(FOREIGN)
    strangers = {
        name
        for name in modules
        if name.startswith("gatewayd.")
        and not name.startswith(("gatewayd.rtde", "gatewayd.loop", "gatewayd.report"))
    }
    assert strangers == set()


@pytest.mark.parametrize("module", ["gatewayd.rtde", "gatewayd.rtde.fields", "gatewayd.rtde.enums"])
def test_tables_load_no_client(module: str) -> None:
    modules = loaded(f"import {module}")
    assert {"asyncio", "gatewayd.rtde.client", "gatewayd.rtde.api.robot"}.isdisjoint(modules)


def test_a_module_is_imported_when_it_is_named() -> None:
    modules = loaded("from gatewayd import rtde", "rtde.sync.connect")
    assert "gatewayd.rtde.sync" in modules
    assert modules.isdisjoint(FOREIGN)


def test_every_public_name_is_there_and_no_other() -> None:
    assert set(rtde.__all__) <= set(dir(rtde))
    assert all(getattr(rtde, name).__name__ == name for name in rtde.__all__ if name != "RobotEvent")
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = rtde.no_such_name  # type: ignore[attr-defined]

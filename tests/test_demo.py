"""The demo package carries the mapping that the demonstration runs."""

from __future__ import annotations

from importlib.resources import files

from gatewayd.demo.scene import MAPPING
from gatewayd.mapping.loader import load


def test_mapping_has_no_findings_at_all() -> None:
    """Not even a warning: `gatewayd check --strict` passes it."""
    loaded = load(files("gatewayd.demo").joinpath(MAPPING).read_bytes(), MAPPING)
    assert loaded.diagnostics == ()
    assert loaded.plan is not None

"""What the robot's kind says of a mapping."""

from __future__ import annotations

from gatewayd.links.robot.language import LANGUAGE
from gatewayd.mapping.loader import load

TEXT = """\
gatewayd: 1
cell: c
robot: {host: r, series: e, frequency: 100, watchdog: {field: input_int_register_23, requires: [plc, hmi]}}
writers: {plc: {modbus: 192.0.2.1}, hmi: {modbus: 192.0.2.2}}
variables: {a: {robot: output_int_register_0..1}}
"""


def test_the_watchdog_names_writers() -> None:
    named = list(LANGUAGE.names_writers(load(TEXT.encode(), "f").cell.document))
    assert [(one.name, one.position.line) for one in named] == [("plc", 3), ("hmi", 3)]


def test_settings_of_the_cell() -> None:
    """Five periods of silence are stale; a cell whose robot cannot be read gets the defaults."""
    cell = load(TEXT.encode(), "f").cell
    assert (cell.settings.stale_after, cell.settings.rate) == (0.1, 100)
    broken = load(TEXT.replace("host: r", "host: 5 5").encode(), "f").cell
    assert (broken.settings.adopt_for, broken.settings.rate) == (10.0, 500)


def test_a_line_as_written() -> None:
    assert LANGUAGE.named(load(TEXT.encode(), "f").cell.document.variables["a"]) == "output_int_register_0..1"

"""Pictures of panels."""

from __future__ import annotations

import sys
from xml.etree import ElementTree as ET

import pytest

from gatewayd.cli.rtde.drawing import draw
from gatewayd.cli.rtde.panels import panels
from gatewayd.cli.rtde.plotted import plotted
from gatewayd.rtde.fields import OUTPUTS
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.recording import MissingExtraError, columns

NAMES = ("timestamp", "target_q", "actual_q", "runtime_state")
RECIPE = Recipe(NAMES, [OUTPUTS[name].type for name in NAMES])
ROWS = [((number / 10, *(0.1 * number,) * 6, *(0.2 * number,) * 6, number), None) for number in range(10)]


def picture(form: str, *names: str) -> bytes:
    drawn = {"x.csv": plotted(ROWS, RECIPE, columns(RECIPE))}
    return draw(form, panels(RECIPE, names), drawn, title="a < b", time_label="time in s")


def test_an_svg_has_its_texts_as_text_and_a_curve_for_each_column() -> None:
    root = ET.fromstring(picture("svg", *columns(RECIPE)[1:]))  # noqa: S314 - our own
    texts = ["".join(element.itertext()) for element in root.iter("{http://www.w3.org/2000/svg}text")]
    for text in (
        "a < b",
        "time in s",
        "q, base in rad",
        "q, wrist 3 in rad",
        "target_q",
        "actual_q",
        "runtime_state",
    ):
        assert text in texts
    assert texts.count("time in s") == 2
    groups = [element.get("id") or "" for element in root.iter("{http://www.w3.org/2000/svg}g")]
    assert sum(group.startswith("axes_") for group in groups) == 7


def test_several_recordings_share_the_panels_of_what_they_have() -> None:
    other = Recipe(["runtime_state"], [OUTPUTS["runtime_state"].type])
    drawn = {
        "a": plotted(ROWS, RECIPE, columns(RECIPE)),
        "b": plotted([((1,), None)], other, columns(RECIPE)),
    }
    shown = draw(
        "svg", panels(RECIPE, ["runtime_state", "actual_q_0"]), drawn, title="", time_label=""
    ).decode()
    texts = ("a: runtime_state", "b: runtime_state", "a: actual_q", "b: actual_q")
    assert [text for text in texts if text in shown] == [
        "a: runtime_state",
        "b: runtime_state",
        "a: actual_q",
    ]


def test_an_svg_is_the_same_each_time() -> None:
    assert picture("svg", "runtime_state") == picture("svg", "runtime_state")


@pytest.mark.parametrize("form, begin", [("png", b"\x89PNG\r\n\x1a\n"), ("pdf", b"%PDF")])
def test_other_forms(form: str, begin: bytes) -> None:
    assert picture(form, "runtime_state").startswith(begin)


def test_without_matplotlib_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingExtraError) as error:
        picture("png", "runtime_state")
    assert str(error.value) == (
        "A picture needs the package matplotlib, which is not installed: pip install 'gatewayd[plot]'"
    )

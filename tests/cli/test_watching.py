"""The picture of `gatewayd watch` and its keys: everything is shown where it fits, nothing old passes for new."""

from __future__ import annotations

from dataclasses import replace

import pytest
from rich.console import Console

from gatewayd.audit.trail import Audit
from gatewayd.cli.watching import KEYS, Glimpse, Show, View, chosen, plain, press, screen, settled
from gatewayd.control.api import Api
from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.requester import Requester
from tests.control.served import CYCLES, SPEED, FixedGateway, Served, at, bring_up, plan
from tests.works import finished


@pytest.fixture
def served() -> Served:
    found = Served(plan(), Cell(plan().cell))
    bring_up(found.cell, 0.0)
    return found


def glimpse(served: Served, now: float = 1.0) -> Glimpse:
    api = Api(FixedGateway([served]), Audit())
    return Glimpse(
        finished(api.status(at(now))),
        finished(api.variables({}, at(now)))["variables"],
        finished(api.events({}, at(now)))["events"],
    )


def test_lines_without_a_match_say_so(served: Served) -> None:
    assert "no variable matches" in plain(glimpse(served), View(filter="zzz"))
    assert "no variable matches" not in plain(glimpse(served), View())


def picture(found: Glimpse, view: View, width: int, height: int, before: Glimpse | None = None) -> list[str]:
    console = Console(width=width, height=height, record=True, file=None, force_terminal=False, quiet=False)
    with console.capture() as captured:
        console.print(screen(found, before, settled(view, found, width, height), width))
    return captured.get().rstrip("\n").split("\n")


@pytest.mark.parametrize("width, height", [(80, 24), (100, 30), (140, 40), (60, 12)])
def test_it_fits_and_shows_the_keys(served: Served, width: int, height: int) -> None:
    lines = picture(glimpse(served), View(), width, height)
    assert len(lines) <= height
    assert all(len(line) <= width for line in lines)
    assert lines[-1].strip().startswith(KEYS[:30])


@pytest.mark.parametrize("width", [40, 60, 72, 80, 120])
def test_long_lines_are_broken_and_not_cut(served: Served, width: int) -> None:
    assert served.cell.operator.force(CYCLES, 1234567890, 1.0, 31.0) is None
    served.cell.robot_lost("connection refused: the robot is booting, or its RTDE service is off", 1.0)
    lines = picture(glimpse(served), View(), width, 40)
    assert len(lines) <= 40
    assert max(map(len, lines)) <= width
    text = " ".join("\n".join(lines).split())
    assert "\u2026" not in text
    for whole in ("robot lost", "writes 0 accepted, 0 refused", "modbus listening", "1234567890"):
        assert whole in text


@pytest.mark.parametrize(
    "width, left_out", [(80, "wider: places, robot register"), (100, "wider: robot register"), (130, "")]
)
def test_columns_that_a_narrow_screen_leaves_out_are_named(served: Served, width: int, left_out: str) -> None:
    text = "\n".join(picture(glimpse(served), View(), width, 24))
    assert left_out in text
    assert ("wider: " in text) is bool(left_out)


@pytest.mark.parametrize("width", [60, 80])
def test_no_value_is_cut(served: Served, width: int) -> None:
    assert served.cell.operator.force(CYCLES, 1234567890, 1.0, 31.0) is None
    (cycles,) = [line for line in picture(glimpse(served), View(), width, 24) if " ← cycles " in line]
    assert "1234567890" in cycles
    assert "forced, 30" in cycles, "the owner is seen too"


def test_wide_ones_show_both_places(served: Served) -> None:
    assert "400025" in "\n".join(picture(glimpse(served), View(), 100, 30))
    assert "input_double_register_1" in "\n".join(picture(glimpse(served), View(), 140, 30))


def test_owner_lease_and_force(served: Served) -> None:
    assert served.cell.write(Requester(0), [Change(SPEED, 0.5)], 1.0) is None
    assert served.cell.operator.force(CYCLES, 99, 1.0, 31.0) is None
    lines = picture(glimpse(served), View(), 100, 30)
    (speed,) = [line for line in lines if " speed " in line]
    (cycles,) = [line for line in lines if " ← cycles " in line]
    assert "plc, 2.0 s left" in speed
    assert "99" in cycles
    assert "forced, 30.0 s left" in cycles


def test_a_gateway_that_is_gone_is_said_in_the_first_line(served: Served) -> None:
    found = replace(glimpse(served), lost="no gatewayd listens")
    assert "everything below is old: no gatewayd listens" in picture(found, View(), 100, 30)[0]
    assert "no gatewayd listens" in plain(found, View())


def test_a_pause_is_said_too(served: Served) -> None:
    assert "PAUSED" in picture(glimpse(served), View(paused=True), 120, 30)[0]


def test_degraded_with_the_first_reason(served: Served) -> None:
    served.cell.robot_lost("gone", 0.5)
    assert "degraded: press: robot not connected" in picture(glimpse(served), View(), 100, 30)[0]


class TestKeys:
    def test_filtering_by_name_register_and_owner(self, served: Served) -> None:
        assert served.cell.write(Requester(0), [Change(SPEED, 0.5)], 0.9) is None
        found = glimpse(served)
        view = View()
        for key in "/", "T", "c", "p":
            view = press(view, key)
        assert (view.filter, view.typing) == ("Tcp", True)
        assert [one["name"] for one in chosen(found.variables, view)] == [f"tcp[{n}]" for n in range(6)]
        view = press(press(view, "backspace"), "enter")
        assert (view.filter, view.typing) == ("Tc", False)
        assert press(view, "esc").filter == ""
        names = [one["name"] for one in chosen(found.variables, View(filter="plc"))]
        assert names == ["speed", "path"]
        assert [one["name"] for one in chosen(found.variables, View(filter="input_bits.3"))] == ["door"]

    def test_keys_are_text_while_typing(self) -> None:
        view = View(typing=True)
        for key in ("q", "d", " ", "up", "b"):
            view = press(view, key)
        assert (view.filter, view.over, view.show) == ("qd b", False, Show.ALL)
        assert press(view, "esc") == replace(view, typing=False, filter="")

    def test_direction_goes_round(self, served: Served) -> None:
        found, view = glimpse(served), View()
        counts = []
        for _ in range(3):
            view = press(view, "d")
            counts.append(len(chosen(found.variables, view)))
        assert counts == [4, 8, 12]

    def test_only_bad(self, served: Served) -> None:
        assert served.cell.operator.force(CYCLES, 99, 0.5, 31.0) is None
        view = press(View(), "b")
        assert [one["name"] for one in chosen(glimpse(served).variables, view)] == ["cycles"]
        assert "no variable matches" in "\n".join(
            picture(glimpse(served), replace(view, filter="x"), 100, 30)
        )

    def test_scrolling_stops_at_both_ends(self, served: Served) -> None:
        found = glimpse(served)
        view = settled(press(View(), "end"), found, 100, 15)
        assert view.top == 12 - view.page
        assert settled(press(view, "up"), found, 100, 15).top == view.top - 1
        assert press(view, "home").top == 0
        assert press(View(), "up").top == 0
        assert press(replace(view, top=0), "pgdn").top == view.page

    @pytest.mark.parametrize("key", ["q", "Q", "\x03"])
    def test_quitting(self, key: str) -> None:
        assert press(View(), key).over

    def test_unknown_keys_do_nothing(self) -> None:
        assert press(View(), "z") == View()

from __future__ import annotations

from rich.console import Console

from gatewayd.cli.rtde.robot_picture import RobotGlimpse, picture, plain

FRESH = RobotGlimpse("192.0.2.5:30004", {"runtime_state": 2, "timestamp": 7.5}, 7.5, 499.6, 3)


def drawn(glimpse: RobotGlimpse, before: RobotGlimpse | None = None, height: int = 30) -> str:
    console = Console(width=80, height=height, force_terminal=True, color_system="standard", record=True)
    with console.capture() as captured:
        console.print(picture(glimpse, before, height))
    return captured.get()


def test_lines_begin_with_who_and_how_fast() -> None:
    assert plain(FRESH) == [
        "192.0.2.5:30004  7.500 s  500 Hz, 3 skipped",
        "  runtime_state  2  (running)",
        "  timestamp      7.5  s",
        "",
    ]


def test_a_rate_that_was_not_measured_yet_is_not_shown_as_zero() -> None:
    new = RobotGlimpse("192.0.2.5:30004", FRESH.values, 7.5)
    assert plain(new)[0] == "192.0.2.5:30004  7.500 s  measuring the rate, none skipped"


def test_what_is_old_says_so() -> None:
    old = RobotGlimpse("192.0.2.5:30004", FRESH.values, lost="connection refused\x1b[2J")
    assert plain(old)[0] == "192.0.2.5:30004: everything below is old: connection refused\\x1b[2J"
    assert "everything below is old" in drawn(old)
    assert "\x1b[2J" not in drawn(old)


def test_what_has_changed_is_bright() -> None:
    before = RobotGlimpse(FRESH.address, {"runtime_state": 2, "timestamp": 7.0})
    assert "\x1b[1m7.5" in drawn(FRESH, before)
    assert "\x1b[1m2\x1b" not in drawn(FRESH, before)


def test_a_low_screen_says_what_it_does_not_show() -> None:
    assert "1 more: name fewer" in drawn(FRESH, height=7)
    assert "more" not in drawn(FRESH)

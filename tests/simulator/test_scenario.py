"""Scenario files: what is read, and where a mistake stands."""

from __future__ import annotations

import string
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.rtde.fields import Series, SoftwareVersion
from gatewayd.simulator.faults import LongLists
from gatewayd.simulator.scenario import (
    MAX_SIZE,
    ScenarioEntry,
    ScenarioError,
    parse_scenario,
    read_scenario,
)

FULL = '''\
[robots.left]
port = 30004
series = "x"
version = "10.8.0"
model = "ur20"
frequency = 125
uptime = 5
fields = ["dexterity:DOUBLE"]
hold = ["input_int_register_3"]
repeat = 30
program = """
output_int_register_0 = input_int_register_0
"""
start = """
power off          # before anybody connects
"""
timeline = """
# seconds  command
0.5        power on
2s         text part #7 is missing

"""

[robots.left.faults]
strict_lists = "refuse"
protocol_v1 = true
linger = 0.5
overflow_close = "never"

[robots.right]
'''


def test_everything_is_read() -> None:
    left, right = parse_scenario(FULL.encode(), "cell.toml").robots
    assert (left.name, left.line, left.port, left.repeat) == ("left", 1, 30004, 30)
    settings = left.settings
    assert (settings.series, settings.version) == (Series.X, SoftwareVersion(10, 8, 0))
    assert (settings.model, settings.frequency, settings.uptime) == ("ur20", 125, 5)
    assert [field.name for field in settings.fields] == ["dexterity"]
    assert len(settings.program) == 1
    assert settings.faults == {
        "hold": ("input_int_register_3",),
        "long_lists": LongLists.REFUSE,
        "v1_only": True,
        "linger": 0.5,
        "overflow_close": None,
    }
    assert left.start == (ScenarioEntry(0.0, "power off", 15),)
    assert left.timeline == (
        ScenarioEntry(0.5, "power on", 19),
        ScenarioEntry(2.0, "text part", 20),
    )
    assert (right.name, right.line, right.port, right.timeline) == ("right", 30, None, ())
    settings.controller()


@pytest.mark.parametrize(
    "text,message",
    [
        ("", "1: no robot; begin with a line [robots.NAME]"),
        ("robots = 3", "1: no robot; begin with a line [robots.NAME]"),
        ("[robots.left]\nport = ", "2: no TOML: Invalid value"),
        ("[robots.left]\nport = 1\nport = 2\n", "3: no TOML: Cannot overwrite a value"),
        ("[robots.left]\n\nprot = 1\n", "3: unknown key 'prot'; did you mean 'port'?"),
        ("[robot.left]\n", "1: unknown key 'robot'; did you mean 'robots'?"),
        ("[robots.left]\nport = 0\n", "2: port = 0: is not within 1..65535"),
        ("[robots.left]\nport = true\n", "2: port = True: is no whole number"),
        ("[robots.left]\nseries = 3\n", "2: series = 3: is no text; put it in quotes"),
        ("[robots.left]\nseries = 'f'\n", "2: series = 'f': is not one of cb3, e, x"),
        (
            "[robots.left]\nseries = 'e'\nversion = '10.1'\n",
            "3: 10.1 is software of series x, not of e",
        ),
        (
            "[robots.left]\nhold = ['input_int_register_99']\n",
            "2: hold = ['input_int_register_99']: no such input: input_int_register_99",
        ),
        ("[robots.left]\nhold = 'x'\n", '2: hold = \'x\': is no list; write ["one", "two"]'),
        ("[robots.left]\nuptime = -1\n", "2: uptime = -1: -1.0 is not a number of seconds"),
        ("[robots.left]\nrepeat = 0\n", "2: repeat = 0: is not within 0.001..1e+09"),
        ("[robots.left]\nrepeat = nan\n", "2: repeat = nan: is not within 0.001..1e+09"),
        ("[robots.left.faults]\n\ndealy = 1\n", "3: unknown key 'dealy'; did you mean 'delay'?"),
        ("[robots.left.faults]\ndrop = 2\n", "2: drop = 2: is not within 0..1"),
        ("[robots.left.faults]\nfreeze = 1\n", "2: freeze = 1: is neither true nor false"),
        ("[robots.left]\nfaults = 1\n", "2: faults = 1: is no table; write [robots.NAME.faults]"),
        (
            "[robots.left]\nprogram = '''\n\noutput_int_register_0 =\n'''\n",
            "4: expected",
        ),
        (
            '[robots.left]\ntimeline = """\n1 power on\n0.5 power off\n"""\n',
            "4: 0.5 s is before the 1 s of the line above; sort the lines by time",
        ),
        (
            '[robots.left]\ntimeline = """\npower on\n"""\n',
            "3: 'power' is no time; a line is seconds and a command: `2.5 power on`",
        ),
        ('[robots.left]\ntimeline = "7"\n', "2: a time without a command; write `2.5 power on`"),
        ("[robots.left]\nport = 7\n[robots.right]\nport = 7\n", "4: port 7 is that of 'left' as well"),
        ("[robots.'a b']\n", "1: 'a b' is no name; take letters, digits, - and _ (32 at most)"),
        ("[robots]\nleft = 1\n", "2: 'left' is no table; write [robots.left]"),
        ("a = " + "[" * 5000, "1: no TOML: nested too deeply"),
        ("\n" * 3 + "x" * MAX_SIZE, "1: larger than 1048576 bytes; split the scenario"),
    ],
)
def test_a_mistake_has_its_line_and_a_remedy(text: str, message: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(text.encode(), "cell.toml")
    assert str(caught.value).startswith(f"cell.toml:{message}"), str(caught.value)


def test_text_of_another_encoding_has_its_line() -> None:
    with pytest.raises(ScenarioError, match="cell:2: is not UTF-8 text"):
        parse_scenario(b"# x\n# \xff\n", "cell")


def test_a_file_is_read_and_a_missing_one_is_an_error_of_the_system(tmp_path: Path) -> None:
    path = tmp_path / "cell.toml"
    path.write_bytes(FULL.replace("\n", "\r\n").encode())
    scenario = read_scenario(path)
    assert scenario.file == str(path)
    assert scenario.robots[0].timeline[0].line == 19
    with pytest.raises(FileNotFoundError):
        read_scenario(tmp_path / "none")


def mistake(data: bytes) -> ScenarioError | None:
    """What is wrong with a file. Any other exception fails the test."""
    try:
        parse_scenario(data, "cell.toml")
    except ScenarioError as error:
        return error
    return None


@given(st.binary(max_size=300))
def test_no_bytes_raise_anything_but_a_scenario_error(data: bytes) -> None:
    error = mistake(data)
    assert error is None or error.line >= 1


SIGNS = st.text(st.sampled_from(string.ascii_letters + string.digits + "\"'[]{}=.#\n \t-"), max_size=8)


@given(st.integers(0, len(FULL)), st.integers(0, 12), SIGNS)
def test_a_damaged_file_is_read_or_refused_with_a_line_that_it_has(at: int, length: int, text: str) -> None:
    damaged = FULL[:at] + text + FULL[at + length :]
    error = mistake(damaged.encode())
    assert error is None or 1 <= error.line <= damaged.count("\n") + 1


times = st.lists(st.floats(0, 1000, allow_nan=False), max_size=20).map(sorted)


@given(times)
def test_times_come_back_in_their_order(found: list[float]) -> None:
    lines = "\n".join(f"{at!r} freeze on" for at in found)
    (robot,) = parse_scenario(f'[robots.r]\ntimeline = """\n{lines}\n"""\n'.encode(), "cell").robots
    assert [entry.at for entry in robot.timeline] == found
    assert [entry.line for entry in robot.timeline] == list(range(3, 3 + len(found)))

"""`gatewayd force`: values as people type them, and the refusals they meet."""

from __future__ import annotations

import pytest

from gatewayd.core.image import Quality
from tests.cli.conftest import Invoke, Running
from tests.control.served import CYCLES, LIMIT


def test_an_input_goes_to_the_robot(gateway: Running, invoke: Invoke) -> None:
    done = invoke("force", "limit", "42.5", "--for", "30s")
    assert (done.exit_code, done.output) == (0, "limit is forced to 42.5 N for 30 s: the robot gets it\n")
    assert (gateway.cell.image.values[LIMIT], gateway.cell.image.quality[LIMIT]) == (42.5, Quality.FORCED)


def test_an_output_goes_to_the_fieldbus(gateway: Running, invoke: Invoke) -> None:
    assert (
        invoke("force", "cycles", "99").output == "cycles is forced to 99 for 1 min: the fieldbus sees it\n"
    )
    assert gateway.cell.image.values[CYCLES] == 99


@pytest.mark.parametrize(
    "name, text, value",
    [
        ("tcp[2]", "-0.25", -0.25),
        ("start", "on", True),
        ("start", "0", False),
        ("cycles", "-7", -7),
        ("cycles", "3.0", 3),
    ],
)
def test_values_as_typed(gateway: Running, invoke: Invoke, name: str, text: str, value: object) -> None:
    assert invoke("force", name, text).exit_code == 0
    index = [one.name for one in gateway.cell.definition.variables].index(name)
    assert gateway.cell.image.values[index] == value


@pytest.mark.parametrize(
    "arguments, code, says",
    [
        (("limit", "151"), 1, "value out of limits, 0..150"),
        (("cycles", "1.5"), 1, "must be a whole number"),
        (("cycles", "much"), 2, "is neither a number"),
        (("nothing", "1"), 1, "there is no variable nothing"),
        (("cycels", "1"), 1, "there is no variable cycels; did you mean cycles?"),
        (("cycles", "1", "--for", "25h"), 1, "at most 86400"),
        (("cycles", "1", "--for", "25"), 2, "not a duration"),
        (("cycles",), 2, "Missing argument"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
@pytest.mark.usefixtures("gateway")
def test_refusals(invoke: Invoke, arguments: tuple[str, ...], code: int, says: str) -> None:
    done = invoke("force", *arguments)
    assert done.exit_code == code
    assert says in done.output


@pytest.mark.usefixtures("gateway")
def test_names_are_completed_from_the_running_gateway(
    invoke: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("_GATEWAYD_COMPLETE", "bash_complete")
    monkeypatch.setenv("COMP_WORDS", "gatewayd force tc")
    monkeypatch.setenv("COMP_CWORD", "2")
    assert invoke().output.split() == [f"plain,tcp[{n}]" for n in range(6)]


def test_completion_without_a_gateway_is_empty_not_an_error(
    invoke: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("_GATEWAYD_COMPLETE", "bash_complete")
    monkeypatch.setenv("COMP_WORDS", "gatewayd force tc")
    monkeypatch.setenv("COMP_CWORD", "2")
    assert not invoke().output.strip()

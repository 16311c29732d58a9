"""Which request comes next, and the handshake with the robot program: what a Modbus client block needs around it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from gatewayd.links.modbus_server.plc.model import PlcModel, Poll
from gatewayd.plc.st.dialect import elementary
from gatewayd.plc.st.program import PlcVariable, ProgramUnit, VariableSection, indented


def cyclic(model: PlcModel) -> tuple[Poll, ...]:
    """The requests in the order of their steps, from 1: those of every round, those on demand, then those in turns."""
    fast = [poll for poll in model.polls if not poll.slow and not poll.shared]
    asked = [poll for poll in model.polls if poll.shared]
    slow = [poll for poll in model.polls if poll.slow]
    return (*fast, *asked, *slow)


def demands(model: PlcModel) -> tuple[PlcVariable, ...]:
    """Inputs by which a program asks for what others may hold."""
    comment = "TRUE: write it in every round, which takes its lock"
    return tuple(
        PlcVariable(f"demand_{poll.name}", elementary("BOOL"), comment) for poll in model.polls if poll.shared
    )


RUN: Final = (
    PlcVariable("run", elementary("BOOL")),
    PlcVariable("trusted", elementary("BOOL"), "from the status: nothing is written before"),
    PlcVariable("write", elementary("BOOL"), "the inputs hold what you want: write them"),
)
"""Inputs of a client block, in front of those of its own."""
FAILURES: Final = PlcVariable("failures", elementary("UDINT"), "requests that failed")
WRITTEN: Final = PlcVariable("written", elementary("UDINT"), "rounds in which all writes were confirmed")
"""Outputs of a client block."""


def sequence_call(model: PlcModel, *others: str) -> str:
    """A client block's call of its sequence, with variables named as its inputs; `others`: besides the usual ones."""
    inputs = [
        *(each.name for each in RUN),
        "done",
        "failed",
        *others,
        *(each.name for each in demands(model)),
    ]
    return f"sequence({', '.join(f'{name} := {name}' for name in inputs)});"


def sequence(model: PlcModel) -> ProgramUnit:
    """The block that walks through the poll plan, one request at a time."""
    return ProgramUnit(
        "FUNCTION_BLOCK",
        f"{model.prefix}_Sequence",
        (
            VariableSection(
                "VAR_INPUT",
                (
                    PlcVariable("run", elementary("BOOL"), "connected, and wanted"),
                    PlcVariable("trusted", elementary("BOOL"), "from the status: nothing is written before"),
                    PlcVariable("write", elementary("BOOL"), "the inputs hold what you want: write them"),
                    PlcVariable("done", elementary("BOOL"), "of the client block, one cycle long: answered"),
                    PlcVariable(
                        "failed", elementary("BOOL"), "of the client block: an exception, or no answer"
                    ),
                    PlcVariable(
                        "period",
                        elementary("TIME"),
                        "from round to round",
                        f"T#{round(model.period * 1000)}ms",
                    ),
                    PlcVariable("time_out", elementary("TIME"), "for one request", "T#1s"),
                    *demands(model),
                ),
            ),
            VariableSection(
                "VAR_OUTPUT",
                (
                    PlcVariable("current", elementary("INT"), "which request, from 1 on; 0: none"),
                    PlcVariable("request", elementary("BOOL"), "rises when it is to be sent"),
                    PlcVariable("failures", elementary("UDINT"), "requests that failed"),
                    PlcVariable("written", elementary("UDINT"), "rounds in which all writes were confirmed"),
                ),
            ),
            VariableSection(
                "VAR",
                (
                    PlcVariable("pause", elementary("TON")),
                    PlcVariable("waiting", elementary("TON")),
                    PlcVariable("due", elementary("BOOL")),
                    PlcVariable("turn", elementary("INT"), "which of the slow requests is next"),
                    PlcVariable("all_written", elementary("BOOL")),
                ),
            ),
        ),
        tuple(_walk(model)),
        comment="the poll plan, one request after the other",
    )


def _walk(model: PlcModel) -> Iterator[str]:
    polls = cyclic(model)
    slow = [step for step, poll in enumerate(polls, 1) if poll.slow]
    last_fast = len(polls) - len(slow)
    yield "pause(IN := run AND (current = 0), PT := period);"
    yield "waiting(IN := request, PT := time_out);"
    yield "due := FALSE;"
    yield "IF NOT run THEN"
    yield "  current := 0;"
    yield "  request := FALSE;"
    yield "ELSIF current = 0 THEN"
    yield "  IF pause.Q THEN"
    yield "    all_written := TRUE;"
    yield "    due := TRUE;"
    yield "  END_IF;"
    yield "ELSIF request AND (done OR failed OR waiting.Q) THEN"
    yield "  request := FALSE;"
    yield "  IF NOT done THEN"
    yield "    failures := failures + 1;"
    yield "    all_written := FALSE;"
    yield "  END_IF;"
    yield "ELSIF NOT request THEN"
    yield "  due := TRUE;"
    yield "END_IF;"
    yield "WHILE due DO"
    yield from indented(list(_next(polls, last_fast, slow)))
    yield "END_WHILE;"


def _next(polls: tuple[Poll, ...], last_fast: int, slow: list[int]) -> Iterator[str]:
    yield "current := current + 1;"
    yield f"IF current = {last_fast + 1} THEN"
    yield "  IF all_written AND trusted AND write THEN"
    yield "    written := written + 1;"
    yield "  END_IF;"
    yield "  current := current + turn;"
    yield "  turn := turn + 1;"
    yield f"  IF turn = {len(slow)} THEN"
    yield "    turn := 0;"
    yield "  END_IF;"
    yield f"ELSIF current > {last_fast + 1} THEN"
    yield "  current := 0;"
    yield "END_IF;"
    yield from _wanted(polls)
    yield "due := (current > 0) AND NOT request;"


def _wanted(polls: tuple[Poll, ...]) -> Iterator[str]:
    """Whether the request of a step is to be sent: one that reads always is. A CASE needs a case."""
    writes = {step: poll for step, poll in enumerate(polls, 1) if poll.writes}
    if not writes:
        yield "request := current > 0;"
        return
    yield "CASE current OF"
    for step, poll in writes.items():
        demand = f" AND demand_{poll.name}" if poll.shared else ""
        yield f"  {step}: request := trusted AND write{demand};"
    yield "ELSE"
    yield "  request := current > 0;"
    yield "END_CASE;"


def handshake(model: PlcModel) -> ProgramUnit:
    """Data, then toggle, then acknowledge: the PLC's half of a handshake with the robot program."""
    return ProgramUnit(
        "FUNCTION_BLOCK",
        f"{model.prefix}_Handshake",
        (
            VariableSection("VAR_INPUT", _HANDSHAKE_INPUTS),
            VariableSection("VAR_OUTPUT", _HANDSHAKE_OUTPUTS),
            VariableSection("VAR", _HANDSHAKE_STATE),
        ),
        _HANDSHAKE,
        comment="data, then toggle, then acknowledge",
    )


_HANDSHAKE_INPUTS: Final = (
    PlcVariable("send", elementary("BOOL"), "rises when the data stand in the inputs"),
    PlcVariable("written", elementary("UDINT"), "of the sequence: rounds of writes that were confirmed"),
    PlcVariable(
        "acknowledge", elementary("BOOL"), "bit of the robot: it repeats the toggle when it has the data"
    ),
    PlcVariable("trusted", elementary("BOOL"), "the acknowledge may be used"),
    PlcVariable("time_out", elementary("TIME"), "for the whole handshake", "T#5s"),
)
_HANDSHAKE_OUTPUTS: Final = (
    PlcVariable("toggle", elementary("BOOL"), "bit for the robot: changes when the data are there"),
    PlcVariable("busy", elementary("BOOL")),
    PlcVariable("done", elementary("BOOL"), "acknowledged; until the next begins"),
    PlcVariable("failed", elementary("BOOL"), "not acknowledged in time, or not trusted any more"),
)
_HANDSHAKE_STATE: Final = (
    PlcVariable("expiry", elementary("TON")),
    PlcVariable("state", elementary("INT"), "0 idle, 1 data on their way, 2 waiting for the robot"),
    PlcVariable("sent", elementary("BOOL")),
    PlcVariable("since", elementary("UDINT")),
)
_HANDSHAKE: Final = (
    "expiry(IN := state > 0, PT := time_out);",
    "IF state > 0 THEN",
    "  IF expiry.Q OR NOT trusted THEN",
    "    state := 0;",
    "    failed := TRUE;",
    "  ELSIF (state = 1) AND (written - since >= 2) THEN",
    "    toggle := NOT toggle;",
    "    state := 2;",
    "  ELSIF (state = 2) AND (acknowledge = toggle) THEN",
    "    state := 0;",
    "    done := TRUE;",
    "  END_IF;",
    "ELSIF send AND NOT sent AND trusted THEN",
    "  toggle := acknowledge;",
    "  since := written;",
    "  state := 1;",
    "  done := FALSE;",
    "  failed := FALSE;",
    "END_IF;",
    "sent := send;",
    "busy := state > 0;",
)

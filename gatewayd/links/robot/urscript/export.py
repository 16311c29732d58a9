"""`gatewayd export urscript`: a mapping as a file of functions for the robot program."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import PurePath
from typing import Final

from gatewayd.core.definition import CellDefinition
from gatewayd.links.exports import Export, ExportError, ExportOption
from gatewayd.links.robot.plan import WATCHDOG_MARGIN, WatchdogPlan, robot_of
from gatewayd.links.robot.urscript import handshake as handshakes
from gatewayd.links.robot.urscript import selftest
from gatewayd.links.robot.urscript.accessors import accessors, index_check, wrapped
from gatewayd.links.robot.urscript.handshake import Handshake
from gatewayd.links.robot.urscript.registers import ScriptRegister, others, registers
from gatewayd.links.robot_program import self_test_rounds
from gatewayd.mapping.plan import Plan
from gatewayd.report.wording import alternatives, did_you_mean

_PREFIX = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,31}")


def _urscript(
    plan: Plan, *, prefix: str = "gw", handshake: Sequence[str] = (), writer: str | None = None
) -> str:
    if not _PREFIX.fullmatch(prefix):
        raise ExportError(f"--prefix {prefix}: a name of URScript is a letter, then letters, digits and `_`")
    found = registers(plan.cell)
    watchdog = robot_of(plan).watchdog
    if not found and watchdog is None:
        raise ExportError(
            f"{plan.source}: the mapping has nothing for a robot program: "
            "no variable is a register of the program, and the section `robot` has no `watchdog:`"
        )
    pairs = _handshakes(handshake, found)
    lines = [*_head(plan, watchdog)]
    if watchdog is not None:
        lines += _watch(plan.cell, watchdog, prefix)
    if any(register.indexed for register in found):
        lines += index_check(prefix)
    lines += accessors(found, plan, prefix)
    for pair in pairs:
        lines += handshakes.functions(pair, prefix)
    lines += _self_test(plan, found, pairs, prefix, writer)
    _refuse_twice(lines)
    return "".join(f"{line}\n" for line in lines)


def _refuse_twice(lines: Sequence[str]) -> None:
    """A name that two functions would have, as `lamp_1` and an element of `lamp`: refused, never altered."""
    names = [line.partition("(")[0].removeprefix("def ") for line in lines if line.startswith("def ")]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ExportError(
            f"two functions would be called `{twice}`: rename one of the variables in the mapping"
        )


def _handshakes(texts: Sequence[str], found: Sequence[ScriptRegister]) -> list[Handshake]:
    pairs = [handshakes.handshake(text, found) for text in texts]
    used: dict[int, str] = {}
    for text, pair in zip(texts, pairs, strict=True):
        for bit in (pair.toggle_bit, pair.acknowledge_bit):
            other = used.setdefault(bit.number, text)
            if other is not text:
                raise ExportError(f"--handshake {text}: `{bit.name}` is in --handshake {other} already")
    return pairs


def _head(plan: Plan, watchdog: WatchdogPlan | None) -> Iterator[str]:
    """What the file is, and what of the mapping no function is for."""
    yield from wrapped(
        f"Cell {plan.cell.name}, made by `gatewayd export urscript` from {PurePath(plan.source).name}, fingerprint "
        f"{plan.cell.fingerprint:08X}. Put it before the program (PolyScope: Script, File, in BeforeStart); "
        "make it anew when the mapping changes, and change nothing here."
    )
    yield from wrapped(
        "Values are those of the robot; scales and offsets lie between the gateway and the fieldbus."
    )
    left = others(plan.cell)
    if left:
        yield from wrapped(f"Not registers of a program, and so without a function: {', '.join(left)}.")
    if watchdog is None:
        yield from wrapped(
            "The mapping declares no watchdog: a program that acts on inputs goes on when the gateway is gone."
        )


def _watch(cell: CellDefinition, watchdog: WatchdogPlan, prefix: str) -> Iterator[str]:
    """The call that stops the program when the gateway no longer feeds the watchdog.

    `rtde_set_watchdog` wants the lowest frequency of updates: half of the feeding, so that one late feed stops nothing.
    """
    gone = " or ".join(["the gateway", *(cell.writers[writer].name for writer in watchdog.requires)])
    yield ""
    yield from wrapped(f"call it once, before the loop: the program stops when {gone} is gone")
    yield f"def {prefix}_watch():"
    yield f'  rtde_set_watchdog("{watchdog.field}", {watchdog.frequency / WATCHDOG_MARGIN:.6g}, "stop")'
    yield "end"


def _self_test(
    plan: Plan, found: Sequence[ScriptRegister], pairs: Sequence[Handshake], prefix: str, writer: str | None
) -> Iterator[str]:
    """Needs a handshake to the robot, by which the PLC leads."""
    leading = next((pair for pair in pairs if pair.to_robot), None)
    inputs = _of_writer(plan.cell, writer)
    if leading is None:
        if writer is not None:
            raise ExportError("--writer is for the self test, which needs a --handshake towards the robot")
        return
    members = selftest.in_test(found, leading)
    chosen = [
        member for member in members if not member.register.is_input or member.variable.number in inputs
    ]
    count = self_test_rounds(plan.cell)
    yield from selftest.functions(chosen, count, leading, prefix, () if writer is None else (writer,))


def _of_writer(cell: CellDefinition, writer: str | None) -> frozenset[int]:
    """Numbers of the inputs that the writer may own; all inputs without one."""
    names = [known.name for known in cell.writers]
    if writer is not None and writer not in names:
        known = f"the mapping declares {alternatives(names)}" if names else "the mapping declares no writer"
        hint = did_you_mean(writer, names, known)
        raise ExportError(f"--writer {writer}: there is no such writer: {hint}")
    return frozenset(
        variable.number
        for variable in cell.variables
        if variable.lock is not None
        if writer is None or names.index(writer) in cell.locks[variable.lock].owners
    )


EXPORTS: Final = (
    Export(
        "urscript",
        "Functions for the robot program: registers by name, watchdog, handshakes, self test.",
        """Write the functions of a mapping FILE for the robot program: one for each register, by its name in the
        mapping, with its unit and what the fieldbus sees; the watchdog that stops the program when the gateway or a
        required writer is gone.

        With --handshake two bits pass data on without a doubt: whoever sends writes data, then changes TOGGLE; whoever
        receives takes the data, and makes ACKNOWLEDGE equal to it. One of the two goes to the robot, the other from
        it. A handshake towards the robot also brings a self test, which goes through all registers together with the
        PLC; the file has the values of every round.
        """,
        ("gatewayd export urscript my-cell.yaml -o my-cell.script",),
        (
            ExportOption("--prefix", "What the names of the functions begin with.", "NAME", default="gw"),
            ExportOption(
                "--handshake",
                "Two bits of the mapping; may be given several times.",
                "TOGGLE:ACKNOWLEDGE",
                multiple=True,
            ),
            ExportOption("--writer", "The self test is with this writer: its inputs only.", "NAME"),
        ),
        _urscript,
    ),
)

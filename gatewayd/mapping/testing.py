"""The section `tests:`: sequences of steps with a cell of the mapping, and what has to be true after each.

`gatewayd.maptest` carries them out. Nothing of them is in a plan, and the daemon does not even read them. The words for
reasons and qualities are the core's, said again here so that a check need not import the running core.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal, TypeAlias

from gatewayd.core.definition import Value
from gatewayd.mapping import syntax
from gatewayd.mapping.scalars import Duration, Name, Names, Plain, one_or_many, refuse, scalar
from gatewayd.mapping.section import Section
from gatewayd.mapping.typed import BeforeValidator, Field
from gatewayd.report.wording import alternatives, did_you_mean

OPERATOR_NAME: Final = "operator"
"""The local operator, who is in no mapping; no writer has this name."""
FREE: Final = "free"
"""The owner of what nobody owns; no writer has this name."""
ROBOT_WORDS: Final = ("connected", "lost", "silent", "restarted")
"""What can happen to the robot itself."""
MAX_NAME: Final = 200
"""Characters of the name of a test."""
_VARIABLE = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}(\[[0-9]{1,4}\])?")


def _variable_name(value: object) -> str:
    hint = "write a name of `variables:`; one of a family in quotes: 'recipe[3]'"
    text = scalar(value, "the name of a variable", hint)
    if not _VARIABLE.fullmatch(text):
        refuse(syntax.BAD_NAME, f"`{text}` is not the name of a variable", hint)
    return text


def _test_name(value: object) -> str:
    hint = "say in a sentence what has to be so: `a lost plc stops the robot`"
    text = scalar(value, "the name of a test", hint)
    if not text.strip() or not text.isprintable() or len(text) > MAX_NAME:
        message = f"a test needs a name of 1 to {MAX_NAME} printable characters"
        refuse(syntax.BAD_NAME, message, hint)
    return text


_VARIABLE_SCHEMA = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]{0,63}(\[[0-9]{1,4}\])?$")]
VariableName = Annotated[str, BeforeValidator(_variable_name, json_schema_input_type=_VARIABLE_SCHEMA)]
"""A variable as tables show it: `speed`, `recipe[3]`."""
VariableNames = Annotated[
    tuple[VariableName, ...],
    BeforeValidator(one_or_many, json_schema_input_type=_VARIABLE_SCHEMA | list[_VARIABLE_SCHEMA]),
]
TestName = Annotated[
    str,
    BeforeValidator(
        _test_name, json_schema_input_type=Annotated[str, Field(pattern=rf"^.{{1,{MAX_NAME}}}$")]
    ),
]
"""What the test shows, in words."""
Values: TypeAlias = dict[VariableName, Plain]


def _robot(value: object) -> object:
    if not isinstance(value, dict) and value not in ROBOT_WORDS:
        otherwise = f"write {alternatives(ROBOT_WORDS)}, or the values that it shows: {{cycles: 5}}"
        text = scalar(value, "what the robot does", otherwise)
        hint = did_you_mean(text, ROBOT_WORDS, otherwise)
        refuse(syntax.BAD_CHOICE, f"`{text}` is no event of the robot", hint)
    return value


Refused = Literal[
    "not_writable", "held", "out_of_limits", "robot_lost", "claimed_elsewhere", "heartbeat_lost", "partial_takeover"
]  # fmt: skip
"""The core's reasons that do not depend on how a bus carries a request."""
QualityWord = Literal[
    "good", "stale", "unavailable", "never", "forced", "differs", "out_of_range", "not_running"
]
ProgramWord = Literal["stopping", "stopped", "playing", "pausing", "paused", "resuming", "retracting"]


class StepSpec(Section):
    """One step of a test: time passes, one thing happens, and then something is expected."""

    after: Duration | None = Field(
        default=None, description="simulated time that passes before anything else"
    )
    alive: Names | None = Field(
        default=None,
        description="writers that go on reading, or sending, while `after` passes; default: none",
    )
    # No kind of link has keys at a step, so nobody asks for them by `Section.by`.
    by: Name | None = Field(  # type: ignore[assignment]
        default=None, description=f"the writer that writes, takes or releases; or {OPERATOR_NAME}"
    )
    write: Values | None = Field(default=None, description="values that it writes in one request")
    take: VariableNames | None = Field(
        default=None, description="variables or groups of which it takes the lock without writing"
    )
    release: VariableNames | None = Field(default=None, description="variables or groups that it releases")
    repeat_for: Duration | None = Field(
        default=None, description="how long it writes the same again, every 100 ms"
    )
    refused: Refused | None = Field(
        default=None, description="why the request has to be refused; without it, it has to be accepted"
    )
    connected: Names | None = Field(default=None, description="writers that connect")
    lost: Names | None = Field(
        default=None, description="writers whose connections end, or whose heartbeat is lost"
    )
    robot: (
        Annotated[Values | Literal["connected", "lost", "silent", "restarted"], BeforeValidator(_robot)]
        | None
    ) = Field(
        default=None,
        description="what happens to the robot, or output values that it shows from now on",
    )
    program: ProgramWord | None = Field(
        default=None, description="the state of the robot program from now on"
    )
    force: Values | None = Field(default=None, description="values that the local operator forces")
    unforce: VariableNames | None = Field(default=None, description="forces that the local operator ends")
    unavailable: VariableNames | None = Field(
        default=None, description="variables whose registers the controller gives to another client"
    )
    available: VariableNames | None = Field(
        default=None, description="variables whose registers it gives back"
    )
    expect: Values | None = Field(
        default=None,
        description="values: of inputs what the robot is given, of outputs what a fieldbus shows",
    )
    owner: dict[VariableName, Name] | None = Field(
        default=None, description=f"who owns a variable: a writer, {OPERATOR_NAME}, or {FREE}"
    )
    quality: dict[VariableName, QualityWord] | None = Field(
        default=None, description="the quality of a variable, as the status block has it"
    )


ACTIONS: Final = (
    "write", "take", "release", "lost", "connected", "robot", "program", "force", "unforce", "unavailable", "available",
)  # fmt: skip
"""Keys of a step of which one at most may be there."""
REQUESTS: Final = ("write", "take", "release")
"""Those that `by` belongs to."""
REFUSABLE: Final = (*REQUESTS, "force")
EXPECTATIONS: Final = ("expect", "owner", "quality")


def action_of(step: StepSpec) -> str | None:
    """The key of what happens in a step; None: only time passes, or something is expected."""
    return next((key for key in ACTIONS if getattr(step, key) is not None), None)


def values_of(step: StepSpec) -> Mapping[str, Mapping[str, Value]]:
    """Its tables of values, by key."""
    found: dict[str, Any] = {key: getattr(step, key) for key in ("write", "robot", "force", "expect")}
    return {key: table for key, table in found.items() if isinstance(table, dict)}

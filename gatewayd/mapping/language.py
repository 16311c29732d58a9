"""The mapping language, version 1, put together from its own models and from what each kind of link adds to them.

A variable and a writer have the keys of all kinds, in the order of the registry, before those of the language. The
JSON Schema is generated from these models.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final, Literal, TypeVar, cast

from gatewayd.links.registry import languages
from gatewayd.mapping import syntax
from gatewayd.mapping.model import Group, VariablePolicy, VariableSpec, WriterSpec
from gatewayd.mapping.scalars import CellName, Name, refuse
from gatewayd.mapping.section import Section
from gatewayd.mapping.testing import StepSpec, TestName
from gatewayd.mapping.typed import Field
from gatewayd.report.wording import alternatives

S = TypeVar("S", bound=Section)


def _with(base: type[S], models: Iterable[type[Section] | None], **namespace: Any) -> type[S]:
    """`base` with the keys of the models, which come in this order: keys of the last base are the first ones."""
    bases = (base, *reversed([model for model in models if model is not None]))
    made = type(base.__name__, bases, {"__doc__": base.__doc__, "__module__": __name__, **namespace})
    return cast("type[S]", made)


def _known(writer: WriterSpec) -> None:
    if any(language.knows(writer) for language in languages()):
        return
    having = [language for language in languages() if language.writer_keys is not None]
    keys = alternatives([language.key for language in having])
    examples = alternatives([language.writer_example for language in having])
    refuse(
        syntax.MISSING_KEY,
        f"a writer needs the key {keys}, by which it is known",
        f"add for example {examples}",
    )


VARIABLE: Final = _with(
    VariableSpec,
    (
        *(language.variable_keys for language in languages()),
        VariablePolicy,
        *(language.variable_policies for language in languages()),
    ),
)
"""A variable with the keys of all kinds."""

WRITER: Final = _with(
    WriterSpec,
    (language.writer_keys for language in languages()),
    judge=_known,
    schema_extra={
        "anyOf": [
            {"required": [key]}
            for language in languages()
            if language.writer_keys is not None
            for key in (language.key, *language.writer_also_by)
        ]
    },
)
"""A writer with the keys of all kinds."""

FILE: Final = _with(
    Section,
    (),
    __doc__="A mapping of gatewayd: one robot cell.",
    __annotations__={
        "gatewayd": Literal[1],
        "cell": CellName,
        **{
            language.top_key: dict[Name, language.section]  # type: ignore[name-defined]
            if language.several
            else language.section
            if language.required
            else language.section | None
            for language in languages()
            if language.section is not None
        },
        "writers": dict[Name, WRITER],  # type: ignore[valid-type]
        "groups": dict[Name, Group],
        "variables": dict[Name, VARIABLE],  # type: ignore[valid-type]
        "tests": dict[TestName, tuple[StepSpec, ...]],
    },
    gatewayd=Field(description="version of the mapping language"),
    cell=Field(description="name of the cell"),
    **{
        language.top_key: Field(default_factory=dict, description=language.meaning)
        if language.several
        else Field(description=language.meaning)
        if language.required
        else Field(default=None, description=language.meaning)
        for language in languages()
        if language.section is not None
    },
    writers=Field(default_factory=dict, description="who may write inputs"),
    groups=Field(default_factory=dict, description="variables that are owned together"),
    variables=Field(description="the variables by name"),
    tests=Field(
        default_factory=dict, description="what has to be so: steps of each test, for `gatewayd test`"
    ),
)
"""The whole file."""

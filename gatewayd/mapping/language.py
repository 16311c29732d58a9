"""The mapping language, version 1, put together from its own models and from what each kind of link adds to them.

A variable and a writer have the keys of all kinds, in the order of the registry, before those of the language. The
JSON Schema is generated from these models.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Annotated, Any, Final, Literal, cast

from pydantic import BeforeValidator, ConfigDict, Field, create_model, model_validator

from gatewayd.links.registry import languages
from gatewayd.mapping import syntax
from gatewayd.mapping.model import Group, VariablePolicy, VariableSpec, WriterSpec
from gatewayd.mapping.scalars import CellName, Name, refuse
from gatewayd.mapping.section import Section
from gatewayd.report.wording import alternatives


def _known(writer: WriterSpec) -> WriterSpec:
    if not any(language.knows(writer) for language in languages()):
        having = [language for language in languages() if language.writer_keys is not None]
        keys = alternatives([language.key for language in having])
        examples = alternatives([language.writer_example for language in having])
        refuse(
            syntax.MISSING_KEY,
            f"a writer needs the key {keys}, by which it is known",
            f"add for example {examples}",
        )
    return writer


def _keys(models: Iterable[type[Section] | None]) -> tuple[Any, ...]:
    """Bases whose keys come in this order: pydantic takes those of the last base first."""
    return tuple(reversed([model for model in models if model is not None]))


VARIABLE: Final[type[VariableSpec]] = create_model(
    "VariableSpec",
    __base__=(
        VariableSpec,
        *_keys(language.variable_policies for language in languages()),
        cast("Any", VariablePolicy),
        *_keys(language.variable_keys for language in languages()),
    ),
    __doc__=VariableSpec.__doc__,
)
"""A variable with the keys of all kinds."""

WRITER: Final[type[WriterSpec]] = create_model(
    "WriterSpec",
    __base__=(WriterSpec, *_keys(language.writer_keys for language in languages())),
    __config__=ConfigDict(
        json_schema_extra={
            "anyOf": [
                {"required": [language.key]} for language in languages() if language.writer_keys is not None
            ]
        }
    ),
    __validators__={"known": cast("Callable[..., Any]", model_validator(mode="after")(_known))},
    __doc__=WriterSpec.__doc__,
)
"""A writer with the keys of all kinds."""

_SECTIONS: Final[dict[str, Any]] = {
    language.key: (language.section, Field(description=language.meaning))
    if language.required
    else (language.section | None, Field(default=None, description=language.meaning))
    for language in languages()
}

FILE: Final[type[Section]] = create_model(
    "MappingFile",
    __base__=Section,
    __doc__="A mapping of gatewayd: one robot cell.",
    gatewayd=(
        Annotated[Literal[1], BeforeValidator(lambda value: value, json_schema_input_type=Literal[1])],
        Field(description="version of the mapping language"),
    ),
    cell=(CellName, Field(description="name of the cell")),
    **_SECTIONS,
    writers=(dict[Name, WRITER], Field(default_factory=dict, description="who may write inputs")),  # type: ignore[valid-type]
    groups=(dict[Name, Group], Field(default_factory=dict, description="variables that are owned together")),
    variables=(dict[Name, VARIABLE], Field(description="the variables by name")),  # type: ignore[valid-type]
)
"""The whole file."""

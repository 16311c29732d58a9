"""What the mapping language says by itself of writers, groups and variables, as typed models.

The kinds of links add their sections and keys to it (`gatewayd.mapping.language`). Code that needs those of one kind
asks for them by their class (`Section.by`).

Defaults that hang on other parts of a file (the lease of a list, the type of a register) are worked out by
`expand`; here such a key is None, and `model_fields_set` tells whether it was written.
"""

from __future__ import annotations

from typing import Literal

from gatewayd.core.definition import Fallback
from gatewayd.mapping.scalars import Name, Names, OptionalDuration, OutputPolicy, Real, ReleasePolicy
from gatewayd.mapping.section import Section
from gatewayd.mapping.typed import Field

FORMAT_VERSION = 1
"""Version of the mapping language that this module describes."""
ANY = "any"
"""The owner that stands for every writer; no writer can have this name."""


class WriterSpec(Section):
    """A party that may write inputs."""

    timeout: OptionalDuration = Field(
        default=None,
        description="time without any request after which the writer counts as lost; default: none",
    )
    timeout_counts: Literal["requests", "writes"] = Field(
        default="requests",
        description="what feeds `timeout`: every request, or only writes and lock requests",
    )
    grace: OptionalDuration = Field(
        default=None, description="how long what it owns outlives a connection that ended; default: none"
    )


class Group(Section):
    """Input variables that are only ever owned together."""

    owner: Names | None = Field(
        default=None, description="writers by priority, first is highest; or any (default)"
    )
    lease: OptionalDuration = Field(default=None, description="how long the owner keeps it without writing")
    takeover: bool | None = Field(
        default=None, description="whether a writer named earlier takes it over; default: yes for a list"
    )
    whole: bool = Field(
        default=False, description="refuse a takeover that does not write every variable of the group"
    )
    comment: str = Field(default="", max_length=500, description="for people")


class VariablePolicy(Section):
    """Who may write a variable, and what values it has."""

    owner: Names | None = Field(
        default=None, description="writers by priority, first is highest; or any (default, first come)"
    )
    takeover: bool | None = Field(
        default=None, description="whether a writer named earlier takes it over; default: yes for a list"
    )
    lease: OptionalDuration = Field(
        default=None,
        description="how long an owner keeps it without writing; default: none for one owner, 5s for a list and any",
    )
    group: Name | None = Field(default=None, description="group that it is owned with")
    limits: tuple[Real, Real] | None = Field(
        default=None, description="least and greatest value in the robot's unit"
    )
    clamp: bool = Field(
        default=False, description="bring values outside the limits to the limit instead of refusing"
    )
    on_release: ReleasePolicy = Field(
        default=Fallback(),
        description="inputs: clear (default), hold, or a value given when the owner is lost",
        json_schema_extra={"default": "clear"},
    )
    on_stale: OutputPolicy = Field(
        default=Fallback(),
        description="outputs: clear (default), hold, exception, or a value seen when the robot is lost",
        json_schema_extra={"default": "clear"},
    )


class VariableSpec(VariablePolicy):
    """One variable, or a family of variables on one line."""

    deadband: Real = Field(
        default=0.0,
        ge=0,
        description="least change of a real that makes an event-driven PDO or a message by MQTT send",
    )
    unit: str = Field(default="", max_length=32, description="unit of the robot's value, for people")
    comment: str = Field(default="", max_length=500, description="for people")

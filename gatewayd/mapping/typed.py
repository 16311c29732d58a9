"""How typed tables are declared: the bounds and readers of keys in annotations, and what is said of a wrong value.

The words are those of pydantic, whose ideas these are (`gatewayd.mapping.tables` has the tables, and the reasons).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Annotated, Any, Final, NamedTuple, TypeAlias, TypeVar

T = TypeVar("T")
Step: TypeAlias = str | int
Path: TypeAlias = tuple[Step, ...]

ABSENT: Final = object()
"""Stands for a default that a key does not have."""


class Mistake(NamedTuple):
    """One thing that is wrong with a table."""

    kind: str
    """What is wrong: one of the words of this module, or the slug of the rule that is broken (`ValueRefused`)."""
    path: Path
    """Keys and indices that lead to the place, which need not exist: a missing key has one too."""
    context: Mapping[str, Any]
    """What the kind leaves open: the bound, the choices, or message and hint of a refusal."""


class Invalid(ValueError):
    """A value or a table cannot be read."""

    def __init__(self, mistakes: tuple[Mistake, ...]) -> None:
        super().__init__(
            "; ".join(f"{'.'.join(map(str, mistake.path))}: {mistake.kind}" for mistake in mistakes)
        )
        self.mistakes = mistakes


class ValueRefused(Exception):
    """Raised by a validator: the value breaks a rule."""

    def __init__(self, kind: str, message: str, hint: str) -> None:
        super().__init__(message)
        self.kind, self.message, self.hint = kind, message, hint


class Key:
    """What is known of a key beside its type, and the bounds of a value."""

    __slots__ = ("annotation", "bounds", "default", "default_factory", "description", "examples", "extra")

    def __init__(self, default: Any, bounds: Mapping[str, Any]) -> None:
        self.default, self.bounds = default, bounds
        self.default_factory: Callable[[], Any] | None = None
        self.description = ""
        self.examples: list[str] | None = None
        self.extra: Mapping[str, Any] | None = None
        self.annotation: Any = None

    def is_required(self) -> bool:
        """Whether a table without it is refused."""
        return self.default is ABSENT and self.default_factory is None

    def value_without(self) -> Any:
        """The value where the key is not written."""
        return self.default_factory() if self.default_factory is not None else self.default


def Field(  # noqa: N802 - as it is called where tables are declared so
    default: Any = ABSENT,
    *,
    default_factory: Callable[[], Any] | None = None,
    description: str = "",
    examples: list[str] | None = None,
    json_schema_extra: Mapping[str, Any] | None = None,
    **bounds: Any,
) -> Any:
    """A key's default, description and bounds: `gt`, `ge`, `lt`, `le`, `min_length`, `max_length`, `pattern`."""
    assert bounds.keys() <= _BOUNDS, bounds
    key = Key(default, bounds)
    key.default_factory, key.description = default_factory, description
    key.examples, key.extra = examples, json_schema_extra
    return key


_BOUNDS: Final = {"gt", "ge", "lt", "le", "min_length", "max_length", "pattern"}


class BeforeValidator:
    """In an annotation: `read` makes of the raw value what the type asks for; it may raise `ValueRefused`."""

    __slots__ = ("input_type", "read")

    def __init__(self, read: Callable[[Any], Any], *, json_schema_input_type: Any = None) -> None:
        self.read, self.input_type = read, json_schema_input_type


class AfterValidator:
    """In an annotation: `judge` returns the value that has the type, or another; it may raise `ValueRefused`."""

    __slots__ = ("judge",)

    def __init__(self, judge: Callable[[Any], Any]) -> None:
        self.judge = judge


class Instance:
    """In an annotation: an object of the class is meant, not a table."""


if TYPE_CHECKING:
    InstanceOf: TypeAlias = Annotated[T, Instance()]
else:

    class InstanceOf:
        """An object of a class: what a BeforeValidator has made."""

        def __class_getitem__(cls, item: type) -> object:
            return Annotated[item, Instance()]

"""Typed tables: a class says which keys a table of a mapping file has, and reads one from what YAML made of it.

The class is annotated as a dataclass is. What the annotations say is worked out when a table of the class is read for
the first time: a file has few of the tables that the language knows. Nothing is converted silently: a text is no
number, 1 is no truth value, and a key that the class does not have is refused. All mistakes of a table are found in one
pass, each with its path.

This is what is used of the ideas of pydantic, with its words. It is not pydantic, because importing that and building
its models took longer than reading, judging and compiling the largest mapping.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator, Mapping
from types import NoneType, UnionType
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ClassVar,
    Final,
    Literal,
    Self,
    TypeAlias,
    Union,
    cast,
    dataclass_transform,
    get_args,
    get_origin,
)

from gatewayd.mapping.typed import (
    ABSENT,
    AfterValidator,
    BeforeValidator,
    Field,
    Instance,
    Invalid,
    Key,
    Mistake,
    Path,
    ValueRefused,
)

_BAD: Final = object()
"""Stands for a value in which mistakes were found."""


class _Keys:
    """The keys of a class by name, those of its bases first; worked out when they are asked for."""

    def __get__(self, _table: object, owner: type[TypedTable]) -> Mapping[str, Key]:
        found: Mapping[str, Key] | None = owner.__dict__.get("_own_keys")
        if found is None:
            found = owner._own_keys = dict(_keys_of(owner))  # noqa: SLF001 - it is its own cache
        return found


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(Field,))
class TypedTable:
    """Base of all tables: strict types, no unknown keys, immutable."""

    model_fields: ClassVar[Mapping[str, Key]] = cast("Mapping[str, Key]", _Keys())
    schema_extra: ClassVar[Mapping[str, Any]] = {}
    """What the JSON Schema says beyond the keys."""
    _own_keys: ClassVar[Mapping[str, Key]]
    _own_readers: ClassVar[Mapping[str, Reader]]

    if not TYPE_CHECKING:

        def __init__(self, **data: Any) -> None:
            mistakes: list[Mistake] = []
            self._fill(data, (), mistakes)
            if mistakes:
                raise Invalid(tuple(mistakes))

    @classmethod
    def model_validate(cls, data: Any) -> Self:
        """The table of what YAML made of it. Raises Invalid with all that is wrong."""
        mistakes: list[Mistake] = []
        table = _read_table(cls, data, (), mistakes)
        if mistakes:
            raise Invalid(tuple(mistakes))
        return cast("Self", table)

    def judge(self) -> None:
        """Raise `ValueRefused` where values that are right each by itself are wrong together."""

    @property
    def model_fields_set(self) -> frozenset[str]:
        """The keys that were written."""
        return cast("frozenset[str]", self.__dict__["model_fields_set"])

    def _fill(self, data: Mapping[Any, Any], path: Path, mistakes: list[Mistake]) -> None:
        """Take over what `data` says; whatever is wrong is appended to `mistakes`."""
        values, before = self.__dict__, len(mistakes)
        readers = _readers_of(type(self))
        for name, key in type(self).model_fields.items():
            if name in data:
                values[name] = readers[name](data[name], (*path, name), mistakes)
            elif key.is_required():
                mistakes.append(Mistake("missing", (*path, name), {}))
            else:
                values[name] = key.value_without()
        mistakes += [Mistake("extra_forbidden", (*path, name), {}) for name in data if name not in readers]
        if len(mistakes) > before:
            return
        values["model_fields_set"] = frozenset(data)
        try:
            self.judge()
        except ValueRefused as refusal:
            mistakes.append(_refused(refusal, path))

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"{type(self).__name__} is immutable")

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"{type(self).__name__} is immutable")

    def _values(self) -> tuple[Any, ...]:
        return tuple(self.__dict__[name] for name in type(self).model_fields)

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return self._values() == other._values()

    def __hash__(self) -> int:
        return hash((type(self), self._values()))

    def __repr__(self) -> str:
        values = zip(type(self).model_fields, self._values(), strict=True)
        return f"{type(self).__name__}({', '.join(f'{name}={value!r}' for name, value in values)})"


Reader: TypeAlias = Callable[[Any, Path, list[Mistake]], Any]
"""Value, path to it, mistakes found so far -> what it is read as; anything where it appended a mistake."""


def read(annotation: Any, value: Any) -> Any:
    """The value as the type wants it. Raises Invalid."""
    mistakes: list[Mistake] = []
    result = _reader(annotation, {})(value, (), mistakes)
    if mistakes:
        raise Invalid(tuple(mistakes))
    return result


def _keys_of(table: type[TypedTable]) -> Iterator[tuple[str, Key]]:
    """The keys; one that is declared again keeps its place."""
    found: dict[str, Key] = {}
    for base in reversed(table.__mro__):
        if not issubclass(base, TypedTable) or base is TypedTable:
            continue
        names = sys.modules[base.__module__].__dict__
        for name, annotation in base.__dict__.get("__annotations__", {}).items():  # noqa: RUF063 - inspect is slow
            if isinstance(annotation, str):
                if annotation.startswith("ClassVar"):
                    continue
                annotation = eval(annotation, names)  # noqa: PLW2901, S307 - our own source, as get_type_hints does
            found[name] = _key_of(base.__dict__.get(name, ABSENT), annotation)
    yield from found.items()


def _key_of(declared: Any, annotation: Any) -> Key:
    key = declared if isinstance(declared, Key) else Key(declared, {})
    key.annotation = annotation
    if not key.description:
        described = (note.description for note in _notes(annotation) if isinstance(note, Key))
        key.description = next((text for text in described if text), "")
    return key


def _notes(annotation: Any) -> tuple[Any, ...]:
    return get_args(annotation)[1:] if get_origin(annotation) is Annotated else ()


def _readers_of(table: type[TypedTable]) -> Mapping[str, Reader]:
    found: Mapping[str, Reader] | None = table.__dict__.get("_own_readers")
    if found is None:
        keys = table.model_fields.items()
        found = {name: _reader(key.annotation, key.bounds) for name, key in keys}
        table._own_readers = found  # noqa: SLF001 - it is its own cache
    return found


def _refused(refusal: ValueRefused, path: Path) -> Mistake:
    return Mistake(refusal.kind, path, {"message": refusal.message, "hint": refusal.hint})


# What makes a reader of a type. The bounds of a key hold for the type inside of whatever is around it.


def _reader(annotation: Any, bounds: Mapping[str, Any]) -> Reader:
    origin = get_origin(annotation)
    if origin is Annotated:
        return _annotated(annotation, bounds)
    if origin in (Union, UnionType):
        return _union(get_args(annotation), bounds)
    if origin is Literal:
        return _choice(get_args(annotation))
    if origin is tuple:
        return _items(get_args(annotation), bounds)
    if origin is dict:
        return _by_name(*get_args(annotation))
    if annotation in _PLAIN:
        return _PLAIN[annotation](bounds)
    if issubclass(annotation, TypedTable):
        return lambda value, path, mistakes: _read_table(annotation, value, path, mistakes)
    return _instance(annotation)


def _annotated(annotation: Any, bounds: Mapping[str, Any]) -> Reader:
    kind, *notes = get_args(annotation)
    for note in notes:
        if isinstance(note, Key):
            bounds = {**note.bounds, **bounds}
    plain = _instance(kind) if any(isinstance(note, Instance) for note in notes) else _reader(kind, bounds)
    befores = [note.read for note in reversed(notes) if isinstance(note, BeforeValidator)]
    afters = [note.judge for note in notes if isinstance(note, AfterValidator)]
    if not befores and not afters:
        return plain

    def around(value: Any, path: Path, mistakes: list[Mistake]) -> Any:
        found = len(mistakes)
        try:
            for before in befores:
                value = before(value)
            value = plain(value, path, mistakes)
            if len(mistakes) == found:
                for after in afters:
                    value = after(value)
        except ValueRefused as refusal:
            mistakes.append(_refused(refusal, path))
        return value

    return around


def _union(members: tuple[Any, ...], bounds: Mapping[str, Any]) -> Reader:
    """The first of the types that takes the value; where none does, what the first one says of it."""
    readers = [_reader(member, bounds) for member in members if member is not NoneType]
    optional = NoneType in members
    if len(readers) == 1 and optional:
        [only] = readers
        return lambda value, path, mistakes: None if value is None else only(value, path, mistakes)

    def first(value: Any, path: Path, mistakes: list[Mistake]) -> Any:
        if value is None and optional:
            return None
        reported: list[Mistake] = []
        for reader in readers:
            attempt: list[Mistake] = []
            result = reader(value, path, attempt)
            if not attempt:
                return result
            reported = reported or attempt
        mistakes += reported
        return _BAD

    return first


def _choice(words: tuple[Any, ...]) -> Reader:
    quoted = [repr(word) for word in words]
    expected = f"{', '.join(quoted[:-1])} or {quoted[-1]}" if len(quoted) > 1 else quoted[0]

    def choice(value: Any, path: Path, mistakes: list[Mistake]) -> Any:
        for word in words:
            if value == word and isinstance(value, type(word)) and not isinstance(value, bool):
                return word
        mistakes.append(Mistake("literal_error", path, {"expected": expected}))
        return _BAD

    return choice


def _items(members: tuple[Any, ...], bounds: Mapping[str, Any]) -> Reader:
    if members[1:] == (...,):
        each, most = _reader(members[0], {}), bounds.get("max_length", sys.maxsize)

        def many(value: Any, path: Path, mistakes: list[Mistake]) -> Any:
            if not isinstance(value, (list, tuple)):
                mistakes.append(Mistake("tuple_type", path, {}))
                return _BAD
            if len(value) > most:
                mistakes.append(Mistake("too_long", path, {}))
                return _BAD
            return tuple(each(item, (*path, index), mistakes) for index, item in enumerate(value))

        return many
    readers = [_reader(member, {}) for member in members]

    def some(value: Any, path: Path, mistakes: list[Mistake]) -> Any:
        if not isinstance(value, (list, tuple)):
            mistakes.append(Mistake("tuple_type", path, {}))
            return _BAD
        read = [
            reader(item, (*path, i), mistakes)
            for i, (reader, item) in enumerate(zip(readers, value, strict=False))
        ]
        mistakes += [Mistake("missing", (*path, index), {}) for index in range(len(value), len(readers))]
        if len(value) > len(readers):
            mistakes.append(Mistake("too_long", path, {}))
        return tuple(read)

    return some


def _by_name(names: Any, tables: Any) -> Reader:
    name_of, table_of = _reader(names, {}), _reader(tables, {})

    def by_name(value: Any, path: Path, mistakes: list[Mistake]) -> Any:
        if not isinstance(value, dict):
            mistakes.append(Mistake("dict_type", path, {}))
            return _BAD
        return {
            name_of(name, (*path, name, "[key]"), mistakes): table_of(item, (*path, name), mistakes)
            for name, item in value.items()
        }

    return by_name


def _instance(kind: type) -> Reader:
    def instance(value: Any, path: Path, mistakes: list[Mistake]) -> Any:
        if not isinstance(value, kind):
            mistakes.append(Mistake("is_instance_of", path, {}))
        return value

    return instance


def _read_table(table: type[TypedTable], value: Any, path: Path, mistakes: list[Mistake]) -> Any:
    if isinstance(value, table):
        return value
    if not isinstance(value, dict):
        mistakes.append(Mistake("model_type", path, {}))
        return _BAD
    made = object.__new__(table)
    made._fill(value, path, mistakes)
    return made


def _text(bounds: Mapping[str, Any]) -> Reader:
    least, most = bounds.get("min_length", 0), bounds.get("max_length", sys.maxsize)
    pattern = re.compile(bounds["pattern"].removesuffix("$") + r"\Z") if "pattern" in bounds else None

    def text(value: Any, path: Path, mistakes: list[Mistake]) -> Any:
        if not isinstance(value, str):
            mistakes.append(Mistake("string_type", path, {}))
        elif len(value) < least:
            mistakes.append(Mistake("string_too_short", path, {}))
        elif len(value) > most:
            mistakes.append(Mistake("string_too_long", path, {}))
        elif pattern is not None and pattern.search(value) is None:
            mistakes.append(Mistake("string_pattern_mismatch", path, {}))
        return value

    return text


def _truth(_bounds: Mapping[str, Any]) -> Reader:
    def truth(value: Any, path: Path, mistakes: list[Mistake]) -> Any:
        if not isinstance(value, bool):
            mistakes.append(Mistake("bool_type", path, {}))
        return value

    return truth


def _number(
    kinds: tuple[type, ...], mistake: str, convert: Callable[[Any], Any]
) -> Callable[[Mapping[str, Any]], Reader]:
    def make(bounds: Mapping[str, Any]) -> Reader:
        tests = [
            (kind, name, holds, convert(bounds[name])) for name, kind, holds in _COMPARED if name in bounds
        ]

        def number(value: Any, path: Path, mistakes: list[Mistake]) -> Any:
            if isinstance(value, bool) or not isinstance(value, kinds):
                mistakes.append(Mistake(mistake, path, {}))
                return _BAD
            try:
                value = convert(value)
            except OverflowError:
                mistakes.append(Mistake(mistake, path, {}))
                return _BAD
            for kind, name, holds, bound in tests:
                if not holds(value, bound):
                    mistakes.append(Mistake(kind, path, {name: bound}))
                    break
            return value

        return number

    return make


_COMPARED: Final[tuple[tuple[str, str, Callable[[Any, Any], bool]], ...]] = (
    ("le", "less_than_equal", lambda value, bound: value <= bound),
    ("lt", "less_than", lambda value, bound: value < bound),
    ("ge", "greater_than_equal", lambda value, bound: value >= bound),
    ("gt", "greater_than", lambda value, bound: value > bound),
)
_PLAIN: Final[dict[Any, Callable[[Mapping[str, Any]], Reader]]] = {
    str: _text,
    bool: _truth,
    int: _number((int,), "int_type", int),
    float: _number((int, float), "float_type", float),
}

"""The JSON Schema of the mapping language, for editors: generated from the typed tables, so that it never lags behind.

`python -m gatewayd.mapping.schema > mappings/schema.json` renews the file. A schema cannot say everything:
`gatewayd check` is the authority.
"""

from __future__ import annotations

import inspect
import json
import sys
from collections.abc import Callable, Mapping
from types import NoneType, UnionType
from typing import Annotated, Any, Final, Literal, Union, get_args, get_origin

from gatewayd.mapping.language import FILE
from gatewayd.mapping.tables import TypedTable
from gatewayd.mapping.typed import BeforeValidator, Key

_DIALECT: Final = "https://json-schema.org/draft/2020-12/schema"
_BOUNDS: Final = {
    "ge": "minimum",
    "gt": "exclusiveMinimum",
    "le": "maximum",
    "lt": "exclusiveMaximum",
    "min_length": "minLength",
    "max_length": "maxLength",
    "pattern": "pattern",
}
_PLAIN: Final = {str: "string", bool: "boolean", int: "integer", float: "number"}

Schema = dict[str, Any]


def mapping_schema() -> Schema:
    """Return the schema of a mapping file. Deterministic."""
    definitions = _Definitions()
    file = definitions.table(FILE)
    tables = dict(sorted(definitions.found.items()))
    return {"$schema": _DIALECT, "title": "gatewayd mapping, version 1", "$defs": tables, **file}


def schema_text() -> str:
    """Return the schema as the file holds it."""
    return json.dumps(mapping_schema(), indent=2, ensure_ascii=False) + "\n"


class _Definitions:
    """Makes schemas of types, and keeps those of the tables that they name."""

    def __init__(self) -> None:
        self.found: dict[str, Schema] = {}

    def table(self, table: type[TypedTable]) -> Schema:
        """What a table may hold."""
        keys = table.model_fields
        required = [name for name, key in keys.items() if key.is_required()]
        return _ordered(
            {
                "type": "object",
                "description": inspect.cleandoc(table.__doc__ or ""),
                "properties": {name: self._key(key) for name, key in keys.items()},
                "additionalProperties": False,
                **({"required": required} if required else {}),
                **table.schema_extra,
            }
        )

    def _key(self, key: Key) -> Schema:
        default = key.value_without() if not key.is_required() and key.default_factory is None else None
        facts = (
            {} if default is None else {"default": list(default) if isinstance(default, tuple) else default}
        )
        facts |= {"description": key.description} | dict(key.extra or {})
        return _ordered(self._type(key.annotation, key.bounds) | facts)

    def _type(self, kind: Any, bounds: Mapping[str, Any]) -> Schema:
        arguments = get_args(kind)
        if kind in _PLAIN:
            limits = {_BOUNDS[name]: bound for name, bound in bounds.items() if name in _BOUNDS}
            return _ordered({"type": _PLAIN[kind], **limits})
        make = self._makers.get(get_origin(kind))
        return make(self, arguments, bounds) if make is not None else self._reference(kind)

    def _reference(self, table: type[TypedTable]) -> Schema:
        name = table.__name__
        if name not in self.found:
            self.found[name] = {}  # tables may hold each other
            self.found[name] = self.table(table)
        return {"$ref": f"#/$defs/{name}"}

    def _annotated(self, arguments: tuple[Any, ...], bounds: Mapping[str, Any]) -> Schema:
        kind, *notes = arguments
        keys = [note for note in notes if isinstance(note, Key)]
        for key in keys:
            bounds = {**key.bounds, **bounds}
        if get_origin(kind) is tuple and "max_length" in bounds:
            bounds = {
                "max_items": bounds["max_length"]
            }  # of the list, not of the one text that may stand for it
        written = [note.input_type for note in notes if isinstance(note, BeforeValidator)]
        found = self._type(next((each for each in written if each is not None), kind), bounds)
        for key in keys:
            found |= {} if key.examples is None else {"examples": key.examples}
            found |= key.extra or {}
        return _ordered(found)

    def _union(self, arguments: tuple[Any, ...], bounds: Mapping[str, Any]) -> Schema:
        choices: list[Schema] = []
        for argument in arguments:
            schema = self._type(argument, bounds) if argument is not NoneType else {}
            choices += schema.get("anyOf", [schema] if schema else [])
        return choices[0] if len(choices) == 1 else {"anyOf": choices}

    def _words(self, arguments: tuple[Any, ...], _bounds: Mapping[str, Any]) -> Schema:
        words = {"const": arguments[0]} if len(arguments) == 1 else {"enum": list(arguments)}
        types = {type(word) for word in arguments}
        return {**words, "type": _PLAIN[types.pop()]} if len(types) == 1 else words

    def _items(self, arguments: tuple[Any, ...], bounds: Mapping[str, Any]) -> Schema:
        if len(arguments) == 1 or arguments[1] is ...:
            most = {"maxItems": bounds["max_items"]} if "max_items" in bounds else {}
            return {"items": self._type(arguments[0], {}), **most, "type": "array"}
        items = [self._type(argument, {}) for argument in arguments]
        return {"maxItems": len(items), "minItems": len(items), "prefixItems": items, "type": "array"}

    def _by_name(self, arguments: tuple[Any, ...], _bounds: Mapping[str, Any]) -> Schema:
        name, table = (self._type(argument, {}) for argument in arguments)
        return {
            "additionalProperties": False,
            "patternProperties": {name["pattern"]: table},
            "type": "object",
        }

    _makers: Final[dict[Any, Callable[[_Definitions, tuple[Any, ...], Mapping[str, Any]], Schema]]] = {
        Annotated: _annotated,
        Union: _union,
        UnionType: _union,
        Literal: _words,
        tuple: _items,
        list: _items,
        dict: _by_name,
    }


def _ordered(schema: Schema) -> Schema:
    """The same with its words by the alphabet; keys of a table stay in the order of the language."""
    return dict(sorted(schema.items()))


if __name__ == "__main__":
    sys.stdout.write(schema_text())

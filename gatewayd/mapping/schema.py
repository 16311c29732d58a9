"""The JSON Schema of the mapping language, for editors: generated from the models, so that it never lags behind.

`python -m gatewayd.mapping.schema > mappings/schema.json` renews the file. A schema cannot say everything:
`gatewayd check` is the authority.
"""

from __future__ import annotations

import json
import sys
from typing import Any, Final

from gatewayd.mapping.language import FILE

_DIALECT: Final = "https://json-schema.org/draft/2020-12/schema"


def mapping_schema() -> dict[str, Any]:
    """Return the schema of a mapping file. Deterministic."""
    schema: dict[str, Any] = _tidy(FILE.model_json_schema())
    return {"$schema": _DIALECT, "title": "gatewayd mapping, version 1", **schema}


def schema_text() -> str:
    """Return the schema as the file holds it."""
    return json.dumps(mapping_schema(), indent=2, ensure_ascii=False) + "\n"


def _tidy(thing: Any) -> Any:
    """Take out what means nothing in a mapping: null in place of a missing key, and titles that repeat the key."""
    if isinstance(thing, list):
        return [_tidy(item) for item in thing]
    if not isinstance(thing, dict):
        return thing
    tidy = {
        key: _tidy(value)
        for key, value in thing.items()
        if not (key == "title" and isinstance(value, str)) and not (key == "default" and value is None)
    }
    if "patternProperties" in tidy:
        tidy["additionalProperties"] = False
    choices = [choice for choice in tidy.get("anyOf", ()) if choice != {"type": "null"}]
    if len(choices) == 1:
        del tidy["anyOf"]
        return {**choices[0], **tidy}
    return {**tidy, "anyOf": choices} if choices else tidy


if __name__ == "__main__":
    sys.stdout.write(schema_text())

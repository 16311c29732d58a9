"""Values of a mapping file as their readers get them."""

from __future__ import annotations

from typing import Any

import pytest

from gatewayd.mapping import tables
from gatewayd.mapping.source import Items, Node, Scalar, Table, parse
from gatewayd.mapping.typed import Invalid


def plain(node: Node) -> object:
    """`node` as dict, list and scalar values; numbers remember their text (`WholeNumber`, `RealNumber`)."""
    match node:
        case Scalar():
            return node.value
        case Items():
            return [plain(item) for item in node.items]
        case Table():
            return {key: plain(entry.value) for key, entry in node.entries.items()}


def written(text: str) -> object:
    """What YAML makes of the text of a value."""
    source = parse(f"a: {text}".encode(), "f")
    assert source.root is not None, source.findings
    value = plain(source.root)
    assert isinstance(value, dict)
    return value["a"]


def read(kind: Any, text: str) -> Any:
    return tables.read(kind, written(text))


def refused(kind: Any, text: str) -> tuple[str, str, str]:
    """Rule, message and hint of the refusal."""
    with pytest.raises(Invalid) as caught:
        read(kind, text)
    kind, _path, context = caught.value.mistakes[0]
    return kind, context["message"], context["hint"]

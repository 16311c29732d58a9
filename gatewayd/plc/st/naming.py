"""Numbers of the status block as names, and the bits of its flags: what every link decodes alike."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

from gatewayd.plc.model import CellModel
from gatewayd.plc.st.dialect import Dialect
from gatewayd.plc.st.program import indented
from gatewayd.plc.st.types import meanings

FLAGS: Final[Mapping[int, str]] = {
    0: "values_fresh",
    1: "robot_writable",
    2: "all_good",
    3: "lock_owned",
    6: "watchdog_fed",
}
"""Bit of the word `flags` -> member of the status."""


def trusted_name(target: str, place: str, kind: str, model: CellModel, dialect: Dialect) -> Iterator[str]:
    """The same, but what is old is not known."""
    yield "IF status.trusted THEN"
    yield from indented(list(name_of(target, place, kind, model, dialect)))
    yield "ELSE"
    unknown = [name for name, _text in meanings()[kind]].index("unknown")
    yield f"  status.{target} := {literal_of(kind, unknown, model, dialect)};"
    yield "END_IF;"


def name_of(target: str, place: str, kind: str, model: CellModel, dialect: Dialect) -> Iterator[str]:
    """A number of the status block as a name; one that this program does not know is `unknown`."""
    named = [name for name, _text in meanings()[kind]]
    unknown = named.index("unknown")
    yield f"CASE WORD_TO_INT({place}) OF"
    for number in range(len(named)):
        if number != unknown:
            yield f"  {number}: status.{target} := {literal_of(kind, number, model, dialect)};"
    yield "ELSE"
    yield f"  status.{target} := {literal_of(kind, unknown, model, dialect)};"
    yield "END_CASE;"


def literal_of(kind: str, number: int, model: CellModel, dialect: Dialect) -> str:
    """The name of a number in the dialect, or the number."""
    if not dialect.enumerations:
        return str(number)
    return f"{model.prefix}_{kind}_{meanings()[kind][number][0]}"

"""What the kinds of links together say of a writer and of a variable."""

from __future__ import annotations

from gatewayd.links.language import LinkLanguage
from gatewayd.links.registry import languages
from gatewayd.mapping.expanded import ExpandedCell, ExpandedVariable
from gatewayd.mapping.model import WriterSpec


def known_by(writer: WriterSpec) -> tuple[LinkLanguage, ...]:
    """The kinds of links by which the writer can write, in order; none only where it has errors."""
    return tuple(language for language in languages() if language.knows(writer))


def is_supervised(writer: WriterSpec) -> bool:
    """Whether it is noticed when it hangs, be its connection open or not."""
    if writer.timeout is not None:
        return True
    return all(language.supervises(writer) for language in known_by(writer))


def ways_of(writer: WriterSpec) -> frozenset[str]:
    """All services by which it writes."""
    return frozenset().union(*(language.ways_of_writer(writer) for language in languages()))


def ways_of_variable(variable: ExpandedVariable, cell: ExpandedCell) -> frozenset[str]:
    """All services by which it can be written."""
    return frozenset().union(*(language.ways_of_variable(variable, cell) for language in languages()))


def more_places(variable: ExpandedVariable) -> str:
    """How it gets several places in place of several variables; empty: it does not."""
    return next((more for language in languages() if (more := language.more_places(variable))), "")

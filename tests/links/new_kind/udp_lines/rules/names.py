"""Rule GW899."""

from __future__ import annotations

from collections.abc import Iterator

from gatewayd.mapping.diagnostics import Diagnostic, Position, Related, Rule
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules.registry import cell_rule

from ..language import ExpandedLines  # noqa: TID252 - the package is copied to another place


@cell_rule("GW899")
def name_of_two(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Two variables with one name in lines."""
    lines = cell.link(ExpandedLines)
    first: dict[str, Position] = {}
    for variable, name, position in lines.names if lines is not None else ():
        if name in first:
            related = (Related(first[name], f"`{name}` first used here"),)
            message = f"`{variable.name}` is called `{name}` in lines, as another variable is"
            yield rule.at(position, message, hint="give it another name", related=related)
        first.setdefault(name, position)

"""All rules together: `check_cell` and `check_plant` apply those of the language, and those of the kinds of links that
a file says something of. The rules of a kind are imported when the first such file comes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from importlib import import_module

from gatewayd.links.language import LinkLanguage
from gatewayd.links.registry import languages
from gatewayd.mapping.diagnostics import Diagnostic
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules import bounds, failsafe, ownership, sharing, supervision, testing
from gatewayd.mapping.rules.registry import CELL_CHECKS, PLANT_CHECKS

RULE_MODULES = (bounds, ownership, sharing, failsafe, supervision, testing)
"""The modules with the rules of the language; their import enters these."""


def enter(kinds: Iterable[LinkLanguage]) -> None:
    """Have the rules of these kinds of links applied too."""
    for language in kinds:
        for name in language.rules:
            import_module(name)


def check_cell(cell: ExpandedCell) -> tuple[Diagnostic, ...]:
    """All findings of one cell by itself, in no particular order. Never raises."""
    enter(language for language in languages() if language.concerns(cell.document))
    return tuple(finding for rule, check in CELL_CHECKS for finding in check(rule, cell))


def check_plant(cells: Sequence[ExpandedCell]) -> tuple[Diagnostic, ...]:
    """All findings among cells that are to run in one process, in no particular order. Never raises."""
    return tuple(finding for rule, check in PLANT_CHECKS for finding in check(rule, cells))

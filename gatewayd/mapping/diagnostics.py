"""What a check finds: rules with stable ids, and findings with their exact place in the mapping file."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from typing import TypeVar

FAMILIES = {
    1: "syntax and numbers",
    2: "Modbus",
    3: "robot",
    4: "CANopen",
    5: "ownership",
    6: "fail-safe",
    7: "lossy conversion",
    8: "devices, dashboard server, MQTT",
    9: "tests",
}
"""Rule families by the hundreds digit of their ids."""

_ID = re.compile(r"GW[1-9]\d\d")
_SLUG = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")


class Severity(Enum):
    """Whether a finding keeps the gateway from starting."""

    ERROR = "error"
    WARNING = "warning"


@dataclass(frozen=True, slots=True, order=True)
class Position:
    """A place in a mapping file; `line` and `column` are counted from 1."""

    file: str
    line: int
    column: int

    def __str__(self) -> str:
        """`file:line:column`, as editors and terminals follow it."""
        return f"{self.file}:{self.line}:{self.column}"


@dataclass(frozen=True, slots=True)
class Related:
    """A second place that a finding is about, for example "first used here"."""

    position: Position
    message: str


@dataclass(frozen=True, slots=True)
class Rule:
    """One thing that can be wrong with a mapping. Id and slug are stable: people search by them."""

    id: str
    """`GW` and three digits; the first digit is the family."""
    slug: str
    severity: Severity
    summary: str
    """One line without a full stop."""
    home: str
    """Package that has the rule's folder: `why.md` beside an example that breaks it and one that does not."""

    @property
    def family(self) -> str:
        """Name of the family the id belongs to."""
        return FAMILIES[int(self.id[2])]

    @property
    def folder(self) -> str:
        """Name of the rule's folder."""
        return f"{self.id}-{self.slug}"

    @property
    def why(self) -> str:
        """What goes wrong in the plant and how to put it right: Markdown, shown by `gatewayd check --explain`."""
        from importlib.resources import files  # noqa: PLC0415 - only explanations need it, and it takes 3 ms

        return files(self.home).joinpath(self.folder, "why.md").read_text("utf-8").strip()

    def at(
        self, position: Position, message: str, *, hint: str | None = None, related: tuple[Related, ...] = ()
    ) -> Diagnostic:
        """Make a finding of this rule."""
        return Diagnostic(self, message, position, related, hint)


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One finding: the rule, what was found (with the value), where, and the remedy."""

    rule: Rule
    message: str
    position: Position
    related: tuple[Related, ...] = ()
    hint: str | None = None

    @property
    def severity(self) -> Severity:
        """Severity of the rule."""
        return self.rule.severity


@dataclass(frozen=True, slots=True)
class RetiredRule:
    """A rule that is no longer checked. Its id and slug stay taken: old reports and comments name them."""

    id: str
    slug: str
    reason: str
    """Why nobody is worse off without it: sentences."""


RETIRED = (
    RetiredRule(
        "GW218",
        "foreign-port",
        "It warned of Modbus ports below 1024 other than 502 and 802. Whether such a port can be opened shows at the "
        "start, with the remedy, and many plants use 503 and the following ones on purpose.",
    ),
    RetiredRule(
        "GW307",
        "rate-not-a-divisor",
        "It warned of a `frequency` between two steps of the controller. The controller then sends somewhat more often "
        "than asked, never less often; where `series` is given, `check` computes with the rate that it really has.",
    ),
    RetiredRule(
        "GW418",
        "inhibit-below-frame-time",
        "It warned of an inhibit time shorter than the frame, which holds nothing back. What such a PDO can do to the "
        "bus is counted by GW426 and GW427.",
    ),
)

_Named = TypeVar("_Named", Rule, RetiredRule)
_rules: dict[str, Rule] = {}


def declare(
    rule_id: str,
    slug: str,
    summary: str,
    severity: Severity = Severity.ERROR,
    *,
    home: str = "gatewayd.mapping.syntax",
) -> Rule:
    """Enter a rule into the catalogue. Raises ValueError for a malformed, used or retired id or slug."""
    if not _ID.fullmatch(rule_id) or not _SLUG.fullmatch(slug):
        raise ValueError(f"malformed rule {rule_id} {slug}")
    taken: list[Rule | RetiredRule] = [*RETIRED, *_rules.values()]
    for known in taken:
        if rule_id == known.id or slug == known.slug:
            raise ValueError(f"rule {rule_id} {slug} clashes with {known.id} {known.slug}")
    rule = Rule(rule_id, slug, severity, summary, home)
    _rules[rule_id] = rule
    return rule


def all_rules() -> tuple[Rule, ...]:
    """Return the rules declared so far by id; import `gatewayd.mapping.rules.run` to have them all."""
    return tuple(_rules[key] for key in sorted(_rules))


def rule_of(name: str) -> Rule | None:
    """Return the declared rule with this id or slug (any case), or None."""
    return _named(name, _rules.values())


def retired_rule_of(name: str) -> RetiredRule | None:
    """The same for the rules that are no longer checked."""
    return _named(name, RETIRED)


def _named(name: str, rules: Iterable[_Named]) -> _Named | None:
    wanted = name.strip().casefold()
    return next((rule for rule in rules if wanted in (rule.id.casefold(), rule.slug)), None)

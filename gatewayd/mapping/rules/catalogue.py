"""The rules as documentation: `python -m gatewayd.mapping.rules.catalogue docs/reference` writes `rules.md`.

The reasons come from the rules' folders, so that `gatewayd check --explain` says the same.
"""

from __future__ import annotations

import sys
from itertools import groupby
from pathlib import Path

from gatewayd.links.registry import languages
from gatewayd.mapping.diagnostics import FAMILIES, RETIRED, RetiredRule, Rule, all_rules
from gatewayd.mapping.rules import run


def complete() -> tuple[Rule, ...]:
    """Every rule by id."""
    run.enter(languages())
    return all_rules()


def explanation(rule: Rule | RetiredRule) -> str:
    """What the rule is about, or why it is no longer checked, as Markdown."""
    if isinstance(rule, RetiredRule):
        return f"# {rule.id} {rule.slug}: retired\n\nThis rule is no longer checked. {rule.reason}\n"
    head = f"# {rule.id} {rule.slug}: {rule.summary}"
    kind = f"Family: {rule.family}. Severity: {rule.severity.value}."
    return f"{head}\n\n{kind}\n\n{rule.why}\n"


def catalogue(rules: tuple[Rule, ...]) -> str:
    """All rules by family, then the reason of each one, as Markdown."""
    parts = [_INTRODUCTION]
    for family, group in groupby(rules, key=lambda rule: int(rule.id[2])):
        parts.append(
            f"\n## GW{family}xx: {FAMILIES[family]}\n\n| id | name | severity | finds |\n|---|---|---|---|\n"
        )
        parts.extend(
            f"| [{rule.id}](#{rule.folder.lower()}) | {rule.slug} | {rule.severity.value} | {rule.summary} |\n"
            for rule in group
        )
    parts.append(_RETIRED)
    parts.extend(f"| {rule.id} | {rule.slug} | {rule.reason} |\n" for rule in RETIRED)
    parts.append("\n## Why\n")
    parts.extend(f"\n### {rule.folder}\n\n{rule.why}\n" for rule in rules)
    return "".join(parts)


_INTRODUCTION = """\
# Rules of `gatewayd check`

Every finding names the rule that it breaks. Ids and names are stable. An error keeps the gateway from starting; a
warning does not, unless `--strict` asks for it. `gatewayd check --explain GW214` prints a rule without this page.
Each rule links to its reason, further down.

`--format json` writes one document with `version`, `files`, `errors`, `warnings`, `unreadable` and `findings`. A
finding has `rule`, `slug`, `family`, `severity`, `file`, `line`, `column` (both from 1), `message`, `hint` (or null)
and `related`, a list of `file`, `line`, `column`, `message`. Keys are only ever added. `--format github` writes
annotations for GitHub's workflows.

This page is generated: `python -m gatewayd.mapping.rules.catalogue docs/reference`.
"""

_RETIRED = """
## Retired

These rules are no longer checked. Their ids and names are not given to other rules.

| id | name | why it went |
|---|---|---|
"""


if __name__ == "__main__":
    Path(sys.argv[1], "rules.md").write_text(catalogue(complete()), encoding="utf-8")

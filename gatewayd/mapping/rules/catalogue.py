"""The rules as documentation: `python -m gatewayd.mapping.rules.catalogue docs/reference` writes it.

`rules.md` lists them all; `rules/GWnnn-slug/why.md` explains one beside its `bad.yaml` and `good.yaml`. The words
come from the rules themselves, so that `gatewayd check --explain` says the same without any file.
"""

from __future__ import annotations

import sys
from itertools import groupby
from pathlib import Path

from gatewayd.mapping.diagnostics import FAMILIES, Rule, all_rules
from gatewayd.mapping.rules import run

__all__ = ["catalogue", "complete", "explanation", "folder", "pages"]


def complete() -> tuple[Rule, ...]:
    """Every rule by id."""
    assert run.FAMILY_MODULES
    return all_rules()


def folder(rule: Rule) -> str:
    """Name of the folder with the rule's examples."""
    return f"{rule.id}-{rule.slug}"


def explanation(rule: Rule) -> str:
    """What the rule is about, as Markdown."""
    head = f"# {rule.id} {rule.slug}: {rule.summary}"
    kind = f"Family: {rule.family}. Severity: {rule.severity.value}."
    return f"{head}\n\n{kind}\n\n{rule.why}\n"


def catalogue(rules: tuple[Rule, ...]) -> str:
    """The list of all rules by family, as Markdown."""
    parts = [_INTRODUCTION]
    for family, group in groupby(rules, key=lambda rule: int(rule.id[2])):
        parts.append(
            f"\n## GW{family}xx: {FAMILIES[family]}\n\n| id | name | severity | finds |\n|---|---|---|---|\n"
        )
        parts.extend(
            f"| [{rule.id}](rules/{folder(rule)}/why.md) | {rule.slug} | {rule.severity.value} "
            f"| {rule.summary} |\n"
            for rule in group
        )
    return "".join(parts)


_INTRODUCTION = """\
# Rules of `gatewayd check`

Every finding names the rule that it breaks. Ids and names are stable. An error keeps the gateway from starting; a
warning does not, unless `--strict` asks for it. `gatewayd check --explain GW214` prints a rule without this page.
Each rule links to its reason; beside it lie `bad.yaml`, which breaks this rule, and `good.yaml`, which does not.
Neither has an error of another rule; a warning it may have.

`--format json` writes one document with `version`, `files`, `errors`, `warnings`, `unreadable` and `findings`. A
finding has `rule`, `slug`, `family`, `severity`, `file`, `line`, `column` (both from 1), `message`, `hint` (or null)
and `related`, a list of `file`, `line`, `column`, `message`. Keys are only ever added. `--format github` writes
annotations for GitHub's workflows.

This page is generated: `python -m gatewayd.mapping.rules.catalogue docs/reference`.
"""


def pages(rules: tuple[Rule, ...]) -> dict[str, str]:
    """Every generated page by its path below `docs/reference`."""
    return {"rules.md": catalogue(rules)} | {
        f"rules/{folder(rule)}/why.md": explanation(rule) for rule in rules
    }


def main(target: Path) -> None:
    """Write the pages below `target`."""
    for path, text in pages(complete()).items():
        (target / path).parent.mkdir(parents=True, exist_ok=True)
        (target / path).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))

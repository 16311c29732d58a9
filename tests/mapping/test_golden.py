"""What a mapping means and what is said of it may change only on purpose: findings, fingerprints, tables and exports.

`python -m tests.mapping.test_golden` writes the golden files anew; the diff is what has changed for users.
"""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path
from typing import Any

from click.testing import CliRunner

from gatewayd.cli import command
from gatewayd.mapping.loader import load, load_together
from gatewayd.mapping.rules import catalogue
from gatewayd.report.findings import Outcome, as_json

ROOT = Path(__file__).parents[2]
GOLDEN = Path(__file__).parent / "golden"
FORMS = (
    ("show",), ("show", "--all"), ("show", "--format", "csv"), ("show", "--format", "json"),
    ("show", "--format", "markdown"), ("export", "eds"), ("export", "dcf"), ("export", "urscript"),
)  # fmt: skip
_MAPPING = re.compile(r"```yaml\n(gatewayd: 1\n.*?)```", re.DOTALL)


def findings() -> dict[str, Any]:
    """Everything that `check --format json` says of each rule's examples."""
    found = {}
    for rule in catalogue.complete():
        folder = ROOT.joinpath(*rule.home.split("."), rule.folder)
        for kind in ("bad", "good"):
            files = [(path.name, path.read_bytes()) for path in sorted(folder.glob(f"{kind}*.yaml"))]
            loaded = load_together(files)
            outcome = Outcome(
                tuple(name for name, _ in files), tuple(one for each in loaded for one in each.diagnostics)
            )
            found[f"{rule.folder}/{kind}"] = [_short(one) for one in json.loads(as_json(outcome))["findings"]]
    return found


def _short(finding: dict[str, Any]) -> dict[str, Any]:
    """One line of the golden file."""
    keys = ("file", "line", "column", "message")
    return {
        "rule": f"{finding['rule']} {finding['slug']}, {finding['family']}, {finding['severity']}",
        "at": ":".join(str(finding[key]) for key in keys),
        "hint": finding["hint"],
        "related": [":".join(str(one[key]) for key in keys) for one in finding["related"]],
    }


def fingerprints() -> dict[str, str]:
    """The fingerprint of every mapping that is shipped or shown."""
    texts = {path.name: path.read_text() for path in sorted((ROOT / "mappings").glob("*.yaml"))}
    for page in sorted((ROOT / "docs").rglob("*.md")):
        for number, text in enumerate(_MAPPING.findall(page.read_text())):
            texts[f"{page.stem} {number}"] = text
    plans = {name: load(text.encode(), name).plan for name, text in texts.items()}
    return {name: f"{plan.cell.fingerprint:08X}" for name, plan in plans.items() if plan is not None}


def shown() -> dict[str, str]:
    """Hashes of what `show` and `export` print of the shipped mappings, with the exit code."""
    found = {}
    for path in sorted((ROOT / "mappings").glob("*.yaml")):
        for form in FORMS:
            result = CliRunner(env={"COLUMNS": "140"}).invoke(command, [*form, f"mappings/{path.name}"])
            digest = hashlib.sha256(result.output.encode()).hexdigest()[:16]
            found[f"{path.stem}: {' '.join(form)}"] = f"{result.exit_code} {digest}"
    return found


MADE = {"findings": findings, "fingerprints": fingerprints, "shown": shown}


def _golden(name: str) -> Path:
    return GOLDEN / f"{name}.json"


def test_findings_are_those_of_the_golden_file() -> None:
    assert findings() == json.loads(_golden("findings").read_text())


def test_fingerprints_are_those_of_the_golden_file() -> None:
    made = fingerprints()
    assert len(made) > 5
    assert made == json.loads(_golden("fingerprints").read_text())


def test_tables_and_exports_are_those_of_the_golden_file() -> None:
    assert shown() == json.loads(_golden("shown").read_text())


if __name__ == "__main__":
    GOLDEN.mkdir(exist_ok=True)
    for part, make in MADE.items():
        _golden(part).write_text(json.dumps(make(), indent=1, ensure_ascii=False) + "\n")

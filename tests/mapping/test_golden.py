"""What the mappings of the documentation mean, and what `show` prints on a screen, change only on purpose.

`python -m tests.mapping.test_golden` writes the golden files anew; the diff is what has changed for users.
"""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path

from click.testing import CliRunner

from gatewayd.cli import command
from gatewayd.mapping.loader import load

ROOT = Path(__file__).parents[2]
GOLDEN = Path(__file__).parent / "golden"
FORMS = (("show",), ("show", "--all"), ("export", "urscript"))
_MAPPING = re.compile(r"```yaml\n(gatewayd: 1\n.*?)```", re.DOTALL)


def fingerprints() -> dict[str, str]:
    """The fingerprint of every mapping in the documentation; `tests/contracts.py` has the shipped ones."""
    texts = {}
    for page in sorted((ROOT / "docs").rglob("*.md")):
        for number, text in enumerate(_MAPPING.findall(page.read_text())):
            texts[f"{page.stem} {number}"] = text
    plans = {name: load(text.encode(), name).plan for name, text in texts.items()}
    return {name: f"{plan.cell.fingerprint:08X}" for name, plan in plans.items() if plan is not None}


def shown() -> dict[str, str]:
    """Hashes of what is printed of the shipped mappings, with the exit code."""
    found = {}
    for path in sorted((ROOT / "mappings").glob("*.yaml")):
        for form in FORMS:
            result = CliRunner(env={"COLUMNS": "140"}).invoke(command, [*form, f"mappings/{path.name}"])
            digest = hashlib.sha256(result.output.encode()).hexdigest()[:16]
            found[f"{path.stem}: {' '.join(form)}"] = f"{result.exit_code} {digest}"
    return found


MADE = {"fingerprints": fingerprints, "shown": shown}


def _golden(name: str) -> Path:
    return GOLDEN / f"{name}.json"


def test_fingerprints_are_those_of_the_golden_file() -> None:
    made = fingerprints()
    assert len(made) > 5
    assert made == json.loads(_golden("fingerprints").read_text())


def test_screens_are_those_of_the_golden_file() -> None:
    assert shown() == json.loads(_golden("shown").read_text())


if __name__ == "__main__":
    GOLDEN.mkdir(exist_ok=True)
    for part, make in MADE.items():
        _golden(part).write_text(json.dumps(make(), indent=1, ensure_ascii=False) + "\n")

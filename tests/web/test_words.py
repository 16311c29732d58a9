"""The page's words (gatewayd/web/page/words.js) and ours (gatewayd/report: printable, words) are the same."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path
from shutil import which
from typing import Any

import pytest

from gatewayd.core.image import Quality
from gatewayd.report.printable import printable
from tests.report.test_printable import HOSTILE
from tests.report.test_words import MEANT

WORDS = Path(__file__).parents[2] / "gatewayd" / "web" / "page" / "words.js"


def test_the_page_has_a_word_for_every_quality() -> None:
    found = re.search(r"QUALITIES = \[(.*?)\]", WORDS.read_text("utf-8"), re.DOTALL)
    assert found is not None
    assert len(json.loads(f"[{found[1]}]")) == len(Quality)


@pytest.mark.skipif(which("node") is None, reason="Node.js is not installed (Debian package nodejs)")
def test_the_page_escapes_as_everything_else() -> None:
    texts = [text for text, _shown in HOSTILE.values()]
    texts += ["robot fresh", "Greifer öffnen, 20 µm", "力 12 °C", "<b>&amp;"]
    assert _of_the_page("printable", [[text] for text in texts]) == [printable(text) for text in texts]


@pytest.mark.skipif(which("node") is None, reason="Node.js is not installed (Debian package nodejs)")
def test_the_page_says_of_states_and_bits_what_the_commands_say() -> None:
    calls = [[value, declared] for value, declared, _words in MEANT]
    assert _of_the_page("meaning", calls) == [words for _value, _declared, words in MEANT]


def _of_the_page(function: str, calls: list[list[Any]]) -> list[str]:
    """What a function of the page's words gives for each list of arguments."""
    program = (
        f"import {{ {function} }} from {json.dumps(WORDS.as_uri())};"
        f"console.log(JSON.stringify({json.dumps(calls)}.map((call) => {function}(...call))));"
    )
    command = ["node", "--input-type=module", "--eval", program]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    found: list[str] = json.loads(done.stdout)
    return found

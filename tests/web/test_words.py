"""The page's `printable` (gatewayd/web/page/words.js) and ours (gatewayd/report/printable.py) show the same."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path
from shutil import which

import pytest

from gatewayd.core.image import Quality
from gatewayd.report.printable import printable
from tests.report.test_printable import HOSTILE

WORDS = Path(__file__).parents[2] / "gatewayd" / "web" / "page" / "words.js"


def test_the_page_has_a_word_for_every_quality() -> None:
    found = re.search(r"QUALITIES = \[(.*?)\]", WORDS.read_text("utf-8"), re.DOTALL)
    assert found is not None
    assert len(json.loads(f"[{found[1]}]")) == len(Quality)


@pytest.mark.skipif(which("node") is None, reason="Node.js is not installed (Debian package nodejs)")
def test_the_page_escapes_as_everything_else() -> None:
    texts = [text for text, _shown in HOSTILE.values()]
    texts += ["robot fresh", "Greifer öffnen, 20 µm", "力 12 °C", "<b>&amp;"]
    program = (
        f"import {{ printable }} from {json.dumps(WORDS.as_uri())};"
        f"console.log(JSON.stringify({json.dumps(texts)}.map((text) => printable(text))));"
    )
    command = ["node", "--input-type=module", "--eval", program]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == [printable(text) for text in texts]

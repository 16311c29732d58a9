"""Print CHANGELOG.md as a changelog of Debian: `python packaging/changelog.py VERSION`.

What is unreleased is VERSION's. SOURCE_DATE_EPOCH dates what is unreleased; releases carry their own date.
"""

from __future__ import annotations

import calendar
import os
import re
import sys
import time
import tomllib
from collections.abc import Iterator
from email.utils import formatdate
from pathlib import Path
from textwrap import fill

TREE = Path(__file__).resolve().parent.parent
WIDTH = 78
_RELEASE = re.compile(r"^## \[(.+?)\](?: - (\d{4}-\d\d-\d\d))?$", re.MULTILINE)


def maintainer() -> str:
    """Name and address, from pyproject.toml."""
    (found,) = tomllib.loads((TREE / "pyproject.toml").read_text())["project"]["maintainers"]
    return f"{found['name']} <{found['email']}>"


def changes(text: str) -> Iterator[str]:
    """The sections of one release and the parts of these, each point wrapped."""
    for section in re.split(r"^#{3,4} ", text, flags=re.MULTILINE)[1:]:
        title, _, points = section.partition("\n")
        yield f"  [ {title} ]"
        for point in re.split(r"^- ", points, flags=re.MULTILINE)[1:]:
            words = " ".join(point.split())
            yield fill(words, WIDTH, initial_indent="  * ", subsequent_indent="    ", break_on_hyphens=False)


def entries(text: str, version: str, now: int) -> Iterator[str]:
    """One entry for each release, the newest first."""
    parts = _RELEASE.split(text)[1:]
    for name, date, body in zip(parts[::3], parts[1::3], parts[2::3], strict=True):
        lines = list(changes(body))
        if lines:
            number = version if name == "Unreleased" else name
            seconds = calendar.timegm(time.strptime(date, "%Y-%m-%d")) if date else now
            head = f"gatewayd ({number}) unstable; urgency=medium"
            yield "\n".join([head, "", *lines, "", f" -- {maintainer()}  {formatdate(seconds)}", ""])


if __name__ == "__main__":
    moment = int(os.environ.get("SOURCE_DATE_EPOCH") or time.time())
    sys.stdout.write("\n".join(entries((TREE / "CHANGELOG.md").read_text(), sys.argv[1], moment)))

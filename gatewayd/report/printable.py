"""Text from outside as a person may see it: whatever a controller, a peer, a header or a mapping file says stays on its
line, cannot steer a terminal, and shows what would otherwise be invisible.

Used where text leaves for people: the formatter of the log, the commands' echo of what a gateway answers, the findings
of a check, sentences about events, STATUS= of the service manager, labels of metrics. The page has the same in
gatewayd/web/page/words.js. What programs read (JSON) keeps its content; `json_text` only spells it so that a terminal
is safe as well.
"""

from __future__ import annotations

import json
import re
from typing import Any

MAX_LENGTH = 4000
"""Characters of one text; what is longer is cut and says so. All variables of a full image in a line are shorter."""

_INVISIBLE = re.compile(
    "[\u034f\u115f\u1160\u17b4\u17b5\u180b-\u180f\u2800\u3164\ufe00-\ufe0f\uffa0\U000e0100-\U000e01ef]"
)
"""What Unicode calls a letter, a mark or a symbol and yet shows nothing (default ignorable, or blank). Controls, marks
of direction, other zero-width characters, line separators and surrogates are not printable to begin with."""


def printable(text: str, limit: int | None = MAX_LENGTH) -> str:
    r"""`text` with everything invisible as an escape (`\x1b`, `\u202e`), cut to `limit` characters (None: whole).

    Text that is already printable comes back as it is: to apply it twice changes nothing.
    """
    shown = text[:limit]
    if not _is_clean(shown):
        shown = "".join(_escaped(character) if _is_hidden(character) else character for character in shown)
    if limit is None or max(len(text), len(shown)) <= limit:
        return shown
    rest = f"... ({len(text)} characters)"
    return shown[: limit - len(rest)] + rest


def printable_answer(answer: Any) -> Any:
    """A JSON value with every text in it `printable`, names of members included; for output to people."""
    if isinstance(answer, str):
        return printable(answer)
    if isinstance(answer, dict):
        return {printable_answer(name): printable_answer(value) for name, value in answer.items()}
    if isinstance(answer, list):
        return [printable_answer(value) for value in answer]
    return answer


def json_text(text: str) -> str:
    r"""The same JSON document, in which what is invisible is written as `\uXXXX`. Line ends between its parts stay."""
    if _is_clean(text):
        return text
    return "".join(
        _json_escaped(character) if character != "\n" and _is_hidden(character) else character
        for character in text
    )


def json_document(document: object) -> str:
    """A whole document, for programs and for people's eyes."""
    return json_text(json.dumps(document, indent=2, ensure_ascii=False)) + "\n"


def _is_clean(text: str) -> bool:
    return text.isprintable() and (text.isascii() or not _INVISIBLE.search(text))


def _is_hidden(character: str) -> bool:
    return not character.isprintable() or _INVISIBLE.match(character) is not None


def _escaped(character: str) -> str:
    return character.encode("unicode_escape").decode("ascii")


def _json_escaped(character: str) -> str:
    data = character.encode("utf-16-be", "surrogatepass")
    return "".join(f"\\u{data[at]:02x}{data[at + 1]:02x}" for at in range(0, len(data), 2))

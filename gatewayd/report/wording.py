"""How findings and tables name numbers and lists of things, so that all of them say it alike."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence


def number(value: float) -> str:
    """A number as people write it: without `.0`, without digits that mean nothing."""
    if isinstance(value, int):
        return str(value)
    return f"{value:.10g}"


def cob(cob_id: int) -> str:
    """A COB-ID as every finding and table shows it: `0x1A0`."""
    return f"0x{cob_id:03X}"


def seconds(duration: float) -> str:
    """A duration as the mapping writes it: `500ms` or `2s`."""
    return f"{number(duration * 1000)}ms" if duration < 1 else f"{number(duration)}s"


def one_and_more(names: Sequence[str]) -> str:
    """The first name in backticks and how many follow."""
    more = f" and {len(names) - 1} more" if len(names) > 1 else ""
    return f"`{names[0]}`{more}"


def names_and_more(names: Sequence[str]) -> str:
    """The first two names in backticks and how many follow: "`a`, `b` and 3 more"."""
    shown = " and ".join(f"`{name}`" for name in names[:2])
    return shown if len(names) <= 2 else f"{shown.replace(' and ', ', ')} and {len(names) - 2} more"


def did_you_mean(name: str, known: Iterable[str], otherwise: str) -> str:
    """A hint that names the nearest known name, in whatever case it was written, or else says `otherwise`."""
    names = list(known)
    same = [known_name for known_name in names if known_name.casefold() == name.casefold()]
    close = same or difflib.get_close_matches(name, names, n=1, cutoff=0.6)
    return f"did you mean `{close[0]}`?" if close else otherwise


def family(first: str, last: str) -> str:
    """`recipe[0..23]` for `recipe[0]` and `recipe[23]`: what both begin and end with is said once."""
    if first == last:
        return first
    head = first.rstrip("0123456789]")
    tail = "]" if first.endswith("]") else ""
    return f"{first.removesuffix(tail)}..{last[len(head) :]}" if last.startswith(head) else f"{first}..{last}"


def alternatives(texts: Sequence[str]) -> str:
    """In backticks: "`a`, `b` or `c`"."""
    *others, last = (f"`{text}`" for text in texts)
    return f"{', '.join(others)} or {last}" if others else last

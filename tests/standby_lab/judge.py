"""Whether ever two clients wrote one input of the robot, from what the robot wrote down."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator


def violations(lines: Iterable[str]) -> Iterator[str]:
    """Every accepted package that its sender did not hold whole, and every return of a client after another's."""
    writer: dict[str, str] = {}
    former: dict[str, set[str]] = {}
    gone: set[str] = set()
    for line in lines:
        when, what, client, fields, holders = json.loads(line)
        if what == "gone":
            gone.add(client)
            continue
        if client in gone:
            yield f"{when}: {client} wrote after its end"
        if holders != [client]:
            yield f"{when}: {client} wrote {fields}, held by {holders}"
        for field in fields:
            if client in former.get(field, ()):
                yield f"{when}: {client} wrote {field} again after {writer[field]}"
            if writer.get(field, client) != client:
                former.setdefault(field, set()).add(writer[field])
                if writer[field] not in gone:
                    yield f"{when}: {client} wrote {field} while {writer[field]} was there"
            writer[field] = client


def packages(lines: Iterable[str]) -> int:
    """Input packages that were accepted."""
    return sum(json.loads(line)[1] == "write" for line in lines)

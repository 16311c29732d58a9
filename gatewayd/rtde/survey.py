"""Which fields a controller has, and of what type: asked by lists so short that every controller takes them.

Outputs are asked for by setting up recipes that are never started. What an input's answer is only claiming it shows, so
inputs are claimed, a list at a time, each for as long as its answer takes.
"""

from __future__ import annotations

import asyncio
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace

from gatewayd.rtde.catalogue import OLD_LIST_LIMIT
from gatewayd.rtde.loss import Loss
from gatewayd.rtde.messages import IN_USE, TextMessage
from gatewayd.rtde.reading import fitting
from gatewayd.rtde.session import TIMESTAMP, ClientSettings, Session
from gatewayd.rtde.visit import visit

RELEASE = 1.0
"""Seconds after which inputs that are in use are asked for once more: a controller may be slow to notice that a client
has gone, be it our own last visit."""
_NAME = re.compile(r"[!-+\--~]+")
"""ASCII without blanks and commas."""
_ROOM = OLD_LIST_LIMIT - len(TIMESTAMP) - 1
"""Bytes of a list beside the timestamp, which is always asked for."""


@dataclass(slots=True)
class Survey:
    """What the controller answered."""

    session: Session | None = None
    """The first one; None: there was none."""
    loss: Loss | None = None
    """Why it ended before everything was asked; None: it did not."""
    outputs: dict[str, str] = field(default_factory=dict)
    """Output -> its type's word; or NOT_FOUND, or another word of refusal."""
    inputs: dict[str, str] = field(default_factory=dict)
    """Input -> the same, or IN_USE."""
    texts: tuple[TextMessage, ...] = ()
    """The last that it sent."""


async def survey(settings: ClientSettings, outputs: Sequence[str], inputs: Sequence[str] = ()) -> Survey:
    """Ask the controller of `settings` for these outputs, and claim these inputs for a moment.

    The recipes of the settings do not count. What another client holds is IN_USE; it stays with that client. ValueError
    for what cannot be a name of a field.
    """
    found, output_lists, input_lists = Survey(), list(pieces(outputs)), list(pieces(inputs))
    for names in output_lists:
        if not await _ask(found, replace(settings, outputs=names, inputs=(), watchdog=None)):
            return found
    for names in input_lists:
        if not await _ask(found, replace(settings, outputs=(), inputs=names, watchdog=None)):
            return found
    in_use = [name for name, word in found.inputs.items() if word == IN_USE]
    if in_use:
        await asyncio.sleep(RELEASE)
    for names in pieces(in_use):
        if not await _ask(found, replace(settings, outputs=(), inputs=names, watchdog=None)):
            break
    return found


def pieces(names: Iterable[str], limit: int = _ROOM) -> Iterator[tuple[str, ...]]:
    """The names in lists that every controller takes; ValueError for what cannot stand in one."""
    left = tuple(dict.fromkeys(names))
    for name in left:
        if not _NAME.fullmatch(name):
            raise ValueError(f"{name[:40]!r} cannot be a name of a field")
    while left:
        piece = fitting(left, limit)
        if not piece:
            raise ValueError(f"{left[0][:40]!r}... is too long for a name of a field")
        yield piece
        taken = frozenset(piece)
        left = tuple(name for name in left if name not in taken)


async def _ask(found: Survey, settings: ClientSettings) -> bool:
    """Ask for one list; whether there was an answer."""
    visited = await visit(settings)
    session = visited.session
    found.texts = (*found.texts, *visited.texts)[-8:]
    if session is None:
        found.loss = visited.loss
        return False
    found.session = found.session or session
    outputs = {name: kind.word for name, kind in session.outputs.kinds.items()}
    claimed = (accepted.recipe for accepted in session.inputs.values())
    inputs = {name: kind.word for recipe in claimed for name, kind in recipe.kinds.items()}
    outputs |= {missing.field: missing.word for missing in session.unavailable if missing.output}
    inputs |= {missing.field: missing.word for missing in session.unavailable if not missing.output}
    found.outputs |= {name: outputs[name] for name in settings.outputs if name in outputs}
    found.inputs |= {name: inputs[name] for name in settings.inputs if name in inputs}
    return True

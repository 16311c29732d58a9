"""A bus that keeps what was sent, and an SDO client's view of a few objects."""

from __future__ import annotations

from collections.abc import Iterable

import pytest

from gatewayd.canopen.dictionary import Abort, AbortCode, Dictionary, Object
from gatewayd.canopen.frame import Frame, Priority
from gatewayd.canopen.nmt import NmtSlave, NmtState


class Wire:
    """Takes frames; `take` hands them out once."""

    def __init__(self) -> None:
        self.frames: list[Frame] = []
        self.sent: list[tuple[Frame, Priority]] = []
        """Everything, whether it was taken or not."""
        self.takes = True

    def send(self, frame: Frame, priority: Priority) -> bool:
        if not self.takes:
            return False
        self.frames.append(frame)
        self.sent.append((frame, priority))
        return True

    def take(self) -> list[Frame]:
        frames, self.frames = self.frames, []
        return frames


def slave(node: int, state: NmtState) -> NmtSlave:
    """An NMT slave in a state that the test may change; it sends nothing by itself."""
    made = NmtSlave(lambda _frame, _priority: True, lambda: node, lambda *_: None, lambda *_: None)
    made.state = state
    return made


class Client:
    """Reads and writes unsigned numbers."""

    def __init__(self, objects: Iterable[Object] | Dictionary) -> None:
        self.dictionary = objects if isinstance(objects, Dictionary) else Dictionary(objects)

    def read(self, index: int, subindex: int = 0) -> int:
        return int.from_bytes(self.dictionary.read(index, subindex), "little")

    def write(self, index: int, subindex: int, value: int) -> None:
        size = self.dictionary.entry(index, subindex).type.size
        assert size is not None
        self.dictionary.write(index, subindex, value.to_bytes(size, "little"))

    def refused(self, index: int, subindex: int, value: int, code: AbortCode) -> None:
        """Writing the value is refused with this code, and changes nothing."""
        before = self.read(index, subindex)
        with pytest.raises(Abort) as caught:
            self.write(index, subindex, value)
        assert caught.value.code is code
        assert self.read(index, subindex) == before

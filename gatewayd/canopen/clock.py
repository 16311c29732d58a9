"""TIME: the wall clock of the network, for the log only (CiA 301, 7.2.6, 7.1.6.6 and 7.5.2.15)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from datetime import UTC, datetime, timedelta

from gatewayd.canopen.cob_ids import BASIC_FRAME, Function, is_assignable
from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import Abort, AbortCode, Entry, Object, variable
from gatewayd.canopen.frame import Frame

CONSUMER = 0x8000_0000
"""Bit 31 of 1012h: this node hears TIME."""
EPOCH = datetime(1984, 1, 1, tzinfo=UTC)
_DAY = 86_400_000


def time_of_day(data: bytes) -> datetime | None:
    """The moment in a TIME_OF_DAY of 6 bytes (28 bits of milliseconds, 4 reserved, 16 bits of days).

    The network's clock is taken for UTC. None if the length is another one, or the time of day none.
    """
    if len(data) != 6:
        return None
    milliseconds = int.from_bytes(data[:4], "little") & 0x0FFF_FFFF
    if milliseconds >= _DAY:
        return None
    return EPOCH + timedelta(days=int.from_bytes(data[4:], "little"), milliseconds=milliseconds)


class TimeConsumer:
    """Hands every good TIME message to `on_time(moment, now)`; `changed()` is called when the COB-ID changes."""

    def __init__(self, *, on_time: Callable[[datetime, float], None], changed: Callable[[], None]) -> None:
        self._on_time = on_time
        default = CONSUMER | Function.TIME
        self._cob_id = Entry.parameter(
            0, "COB-ID TIME", CanType.UNSIGNED32, default, check=_check_cob_id, changed=changed
        )

    @property
    def cob_id(self) -> int | None:
        """Where TIME is heard; None if it is not."""
        return self._cob_id.number & BASIC_FRAME if self._cob_id.number & CONSUMER else None

    def objects(self) -> Iterable[Object]:
        """1012h."""
        yield variable(0x1012, self._cob_id)

    def receive(self, frame: Frame, now: float) -> None:
        """A frame with the COB-ID of TIME; a wrong length or an impossible time is ignored."""
        moment = None if frame.remote else time_of_day(frame.data)
        if moment is not None:
            self._on_time(moment, now)


def _check_cob_id(data: bytes) -> None:
    # Bit 30 would make this node a producer, which it cannot be.
    if not is_assignable(int.from_bytes(data, "little"), CONSUMER):
        raise Abort(AbortCode.INVALID_VALUE)

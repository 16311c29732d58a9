"""What a node is asked for and does not serve, counted and worded as on every other fieldbus."""

from __future__ import annotations

from collections.abc import Callable

from gatewayd.canopen.describe import abort_text, object_text
from gatewayd.canopen.dictionary import AbortCode, Dictionary
from gatewayd.canopen.frame import Frame
from gatewayd.canopen.sdo.protocol import Request
from gatewayd.canopen.sdo.server import SdoAbort
from gatewayd.core.cell import Cell
from gatewayd.core.requester import Requester
from gatewayd.core.unserved import Unserved
from gatewayd.report.format import counted

SDO_LENGTH = 8
"""Bytes of every SDO frame."""
_NMT_MASTER = Requester(None, "NMT master")
_SDO_CLIENT = Requester(None, "SDO client")

_REASONS = {
    AbortCode.NO_OBJECT: Unserved.NO_SUCH_ADDRESS,
    AbortCode.NO_SUBINDEX: Unserved.NO_SUCH_ADDRESS,
    AbortCode.UNKNOWN_COMMAND: Unserved.NO_SUCH_FUNCTION,
    AbortCode.TOGGLE: Unserved.MALFORMED,
    AbortCode.BLOCK_SIZE: Unserved.MALFORMED,
    AbortCode.SEQUENCE_NUMBER: Unserved.MALFORMED,
    AbortCode.CRC: Unserved.MALFORMED,
    AbortCode.OUT_OF_MEMORY: Unserved.MALFORMED,
    AbortCode.LENGTH: Unserved.MALFORMED,
    AbortCode.TOO_LONG: Unserved.MALFORMED,
    AbortCode.TOO_SHORT: Unserved.MALFORMED,
    AbortCode.INVALID_VALUE: Unserved.MALFORMED,
    AbortCode.VALUE_TOO_HIGH: Unserved.MALFORMED,
    AbortCode.VALUE_TOO_LOW: Unserved.MALFORMED,
}
"""Of aborts; all others say that this must not be done, or not now."""
_READS = (Request.UPLOAD, Request.BLOCK_UPLOAD)
_BEGINS = (*_READS, Request.DOWNLOAD, Request.BLOCK_DOWNLOAD)


class UnservedFrames:
    """Reports to the cell; `sdo_writer` is who SDO clients are, None if no writer stands for them."""

    def __init__(
        self,
        cell: Cell,
        sdo_writer: int | None,
        clock: Callable[[], float],
        dictionary: Callable[[], Dictionary],
    ) -> None:
        self._cell = cell
        self._client = _SDO_CLIENT if sdo_writer is None else Requester(sdo_writer)
        self._clock = clock
        self._dictionary = dictionary

    def sdo(self, abort: SdoAbort) -> None:
        """A request of an SDO client was refused."""
        reason = _REASONS.get(abort.code, Unserved.NOT_ALLOWED)
        if abort.code is AbortCode.DEVICE_STATE and abort.request in _READS:
            reason = Unserved.ROBOT_LOST
        text = f"{_request(abort)}: {abort_text(abort.code)}{_hint(abort, self._dictionary())}"
        self._report(self._client, reason, text)

    def is_sdo(self, frame: Frame) -> bool:
        """Whether a frame to the SDO server is as long as those of SDO; another one is reported."""
        length = len(frame.data)
        if length != SDO_LENGTH and not frame.remote:
            text = f"sent an SDO frame of {counted(length, 'byte')} instead of {SDO_LENGTH}"
            self._report(self._client, Unserved.MALFORMED, text)
        return length == SDO_LENGTH

    def nmt(self, data: bytes) -> None:
        """An NMT frame to this node that is no command."""
        if len(data) == 2:
            text = f"sent NMT command {data[0]}, which is not known"
            self._report(_NMT_MASTER, Unserved.NO_SUCH_FUNCTION, text)
        else:
            text = f"sent an NMT frame of {counted(len(data), 'byte')} instead of 2"
            self._report(_NMT_MASTER, Unserved.MALFORMED, text)

    def _report(self, requester: Requester, reason: Unserved, text: str) -> None:
        self._cell.unserved(requester, reason, text, self._clock())


def _request(abort: SdoAbort) -> str:
    if not abort.index:
        return "sent an SDO frame that fits no transfer"
    verb = "read" if abort.request in _READS else "wrote" if abort.request in _BEGINS else "transferred"
    return f"{verb} {object_text(abort.index, abort.subindex)} by SDO"


def _hint(abort: SdoAbort, dictionary: Dictionary) -> str:
    """What is there in place of the object that is not."""
    objects = {item.index: item for item in dictionary}
    if abort.code is AbortCode.NO_SUBINDEX and abort.index in objects:
        entries = objects[abort.index].entries
        return f"; {abort.index:04X}h ends with {entries[-1].subindex:02X}"
    if abort.code is not AbortCode.NO_OBJECT:
        return ""
    near = min(objects.values(), key=lambda item: abs(item.index - abort.index))
    return f"; nearest: {near.name} {near.index:04X}h"

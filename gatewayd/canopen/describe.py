"""CANopen frames in words, by the predefined connection set (CiA 301, 7.3.3) and the frame's own content.

Pure, and total: any frame has a description. What needs to be known besides the frame, say which PDO a
device has moved where, is left open.
"""

from __future__ import annotations

import struct

from gatewayd.canopen.cob_ids import Function
from gatewayd.canopen.dictionary import AbortCode
from gatewayd.canopen.frame import Frame
from gatewayd.canopen.nmt import NmtCommand, NmtState
from gatewayd.canopen.sdo.protocol import REQUESTS, Request

_NODES = range(1, 128)
_WORD = struct.Struct("<H")
_LONG = struct.Struct("<I")
_TOGGLE = 0x80

ABORTS = {
    AbortCode.TOGGLE: "toggle bit not alternated",
    AbortCode.TIMED_OUT: "timed out",
    AbortCode.UNKNOWN_COMMAND: "unknown command",
    AbortCode.BLOCK_SIZE: "invalid block size",
    AbortCode.SEQUENCE_NUMBER: "invalid sequence number",
    AbortCode.CRC: "CRC error",
    AbortCode.OUT_OF_MEMORY: "out of memory",
    AbortCode.UNSUPPORTED_ACCESS: "unsupported access",
    AbortCode.WRITE_ONLY: "write only",
    AbortCode.READ_ONLY: "read only",
    AbortCode.NO_OBJECT: "no such object",
    AbortCode.NOT_MAPPABLE: "not mappable into the PDO",
    AbortCode.PDO_LENGTH: "PDO would be too long",
    AbortCode.PARAMETER_INCOMPATIBLE: "incompatible parameters",
    AbortCode.INTERNALLY_INCOMPATIBLE: "incompatible within the device",
    AbortCode.HARDWARE: "hardware error",
    AbortCode.LENGTH: "length does not match",
    AbortCode.TOO_LONG: "too long",
    AbortCode.TOO_SHORT: "too short",
    AbortCode.NO_SUBINDEX: "no such sub-index",
    AbortCode.INVALID_VALUE: "invalid value",
    AbortCode.VALUE_TOO_HIGH: "value too high",
    AbortCode.VALUE_TOO_LOW: "value too low",
    AbortCode.MAXIMUM_BELOW_MINIMUM: "maximum below minimum",
    AbortCode.NO_RESOURCE: "resource not available",
    AbortCode.GENERAL: "general error",
    AbortCode.CANNOT_STORE: "cannot be stored",
    AbortCode.LOCAL_CONTROL: "held by another owner",
    AbortCode.DEVICE_STATE: "not in the present device state",
    AbortCode.NO_DICTIONARY: "no object dictionary",
    AbortCode.NO_DATA: "no data",
}
"""Abort codes in words."""
_LSS = {
    0x04: "switch state global",
    0x11: "configure node-ID",
    0x13: "configure bit timing",
    0x15: "activate bit timing",
    0x17: "store configuration",
    0x40: "switch state selective, vendor",
    0x41: "switch state selective, product",
    0x42: "switch state selective, revision",
    0x43: "switch state selective, serial number",
    0x44: "state switched",
    0x4C: "identify non-configured",
    0x4F: "identified",
    0x50: "identified, non-configured",
    0x51: "fastscan",
    0x5A: "inquire vendor",
    0x5B: "inquire product",
    0x5C: "inquire revision",
    0x5D: "inquire serial number",
    0x5E: "inquire node-ID",
}
_SEGMENTS = {
    Request.DOWNLOAD_SEGMENT: "write segment",
    Request.UPLOAD_SEGMENT: "read next segment",
    Request.BLOCK_DOWNLOAD_END: "block write ends",
    Request.BLOCK_UPLOAD_START: "block read starts",
    Request.BLOCK_UPLOAD_ACKNOWLEDGE: "block read acknowledged",
    Request.BLOCK_UPLOAD_END: "block read ended",
    Request.UNKNOWN: "unknown command",
}
_BEGINNINGS = {
    Request.DOWNLOAD: "write",
    Request.UPLOAD: "read",
    Request.BLOCK_DOWNLOAD: "block write",
    Request.BLOCK_UPLOAD: "block read",
}
_ANSWERS = {0: "segment read", 1: "segment written", 5: "block write", 6: "block read"}


def frame_text(frame: Frame) -> str:
    """`SDO read 2010h:01 of node 5`, `heartbeat of node 5: operational`."""
    can_id = frame.can_id
    if can_id == Function.NMT:
        return _nmt(frame.data)
    if can_id == Function.SYNC:
        return "SYNC" + (f" {frame.data[0]}" if frame.data else "")
    if can_id == Function.TIME:
        return "TIME"
    if can_id in (Function.LSS_REQUEST, Function.LSS_RESPONSE):
        who = "master" if can_id == Function.LSS_REQUEST else "slave"
        command = frame.data[0] if frame.data else 0
        return f"LSS {who}: {_LSS.get(command, f'command {command:02X}h')}"
    base, node = can_id & ~0x7F, can_id & 0x7F
    if node not in _NODES:
        return _content(frame)
    if frame.remote:
        return f"guarding of node {node}" if base == Function.ERROR_CONTROL else f"request of {can_id:03X}h"
    texts = {
        Function.EMCY: _emergency,
        Function.SDO_RESPONSE: _sdo_answer,
        Function.SDO_REQUEST: _sdo_request,
        Function.ERROR_CONTROL: _error_control,
    }
    for function, text in texts.items():
        if base == function:
            return text(frame.data, node)
    if Function.TPDO1 <= base < Function.SDO_RESPONSE:
        number, received = divmod(base - Function.TPDO1, 0x100)
        return f"{'RPDO' if received else 'TPDO'} {number + 1} of node {node}{_bytes(frame.data)}"
    return _content(frame)


def abort_text(code: int) -> str:
    """`06020000h no such object`."""
    known = ABORTS.get(AbortCode(code)) if code in set(AbortCode) else None
    return f"{code:08X}h" + (f" {known}" if known else "")


def object_text(index: int, subindex: int) -> str:
    """`2010h:01`."""
    return f"{index:04X}h:{subindex:02X}"


def nmt_command(command: int) -> str | None:
    """A command of the NMT master in words; None if there is no such."""
    return NmtCommand(command).name.lower().replace("_", " ") if command in set(NmtCommand) else None


def _nmt(data: bytes) -> str:
    if len(data) != 2:
        return f"NMT frame of length {len(data)} instead of 2"
    target = "all nodes" if data[1] == 0 else f"node {data[1]}"
    return f"NMT {nmt_command(data[0]) or f'unknown command {data[0]}'}, {target}"


def _emergency(data: bytes, node: int) -> str:
    if len(data) != 8:
        return f"EMCY of node {node}, length {len(data)} instead of 8"
    (code,) = _WORD.unpack_from(data)
    return f"EMCY of node {node}: {code:04X}h, error register {data[2]:02X}h" + _bytes(data[3:])


def _error_control(data: bytes, node: int) -> str:
    if len(data) != 1:
        return f"error control of node {node}, length {len(data)} instead of 1"
    state = data[0] & ~_TOGGLE
    if data[0] == NmtState.INITIALISING:
        return f"boot-up of node {node}"
    name = NmtState(state).name.lower().replace("_", "-") if state in set(NmtState) else f"state {state}"
    return f"heartbeat of node {node}: {name}" + (", toggled" if data[0] & _TOGGLE else "")


def _sdo_request(data: bytes, node: int) -> str:
    if len(data) != 8:
        return f"SDO request to node {node}, length {len(data)} instead of 8"
    request = REQUESTS[data[0]]
    if request is Request.ABORT:
        return f"SDO {_named(data)} of node {node} aborted by the client: {_code(data)}"
    begun = _BEGINNINGS.get(request)
    if begun is None:
        return f"SDO {_SEGMENTS[request]}, node {node}"
    value = ""
    if request is Request.DOWNLOAD and data[0] & 0x02:
        value = f" ={_bytes(data[4 : 8 - (data[0] >> 2 & 3) if data[0] & 1 else 8])}"
    return f"SDO {begun} {_named(data)} of node {node}{value}"


def _sdo_answer(data: bytes, node: int) -> str:
    if len(data) != 8:
        return f"SDO answer of node {node}, length {len(data)} instead of 8"
    kind, command = data[0] >> 5, data[0]
    if kind == 4:
        return f"SDO {_named(data)} of node {node} refused: {_code(data)}"
    if kind == 3:
        return f"SDO {_named(data)} of node {node} written"
    if kind == 2:
        if command & 0x02:
            return f"SDO {_named(data)} of node {node} ={_bytes(data[4 : 8 - (command >> 2 & 3)])}"
        return f"SDO {_named(data)} of node {node} comes in segments, length {_LONG.unpack_from(data, 4)[0]}"
    return f"SDO {_ANSWERS.get(kind, 'unknown answer')}, node {node}"


def _named(data: bytes) -> str:
    return object_text(_WORD.unpack_from(data, 1)[0], data[3])


def _code(data: bytes) -> str:
    return abort_text(_LONG.unpack_from(data, 4)[0])


def _content(frame: Frame) -> str:
    return f"frame {frame.can_id:03X}h" + (" remote" if frame.remote else _bytes(frame.data))


def _bytes(data: bytes) -> str:
    return f" {data.hex(' ').upper()}" if data else ""

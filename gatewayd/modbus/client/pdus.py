"""What pymodbus encodes, decodes and computes for the client; its types stay here.

Requests of polls are encoded once and sent many times, so its speed (about 1 us each) is no matter. Answers with
registers and bits are not decoded by it: their bytes go to the codec as they are, once their length is what the
request says (`requests.parse_answer`). Its decoder makes a list of numbers that would be bytes again afterwards, at
4 us for 10 registers and 24 us for 125, and takes answers of a wrong length.

Its framers are not used either. The one for TCP waits for ever after a wrong protocol id, and logs each frame; the one
for RTU drops everything that has come in if the first thing that looks like a frame is none.
"""

from __future__ import annotations

from struct import unpack

from pymodbus.framer import FramerRTU
from pymodbus.pdu import ModbusPDU
from pymodbus.pdu.bit_message import (
    ReadCoilsRequest,
    ReadDiscreteInputsRequest,
    WriteMultipleCoilsRequest,
    WriteSingleCoilRequest,
)
from pymodbus.pdu.mei_message import ReadDeviceInformationRequest, ReadDeviceInformationResponse
from pymodbus.pdu.register_message import (
    MaskWriteRegisterRequest,
    ReadHoldingRegistersRequest,
    ReadInputRegistersRequest,
    ReadWriteMultipleRegistersRequest,
    WriteMultipleRegistersRequest,
    WriteSingleRegisterRequest,
)

_READING: dict[int, type[ModbusPDU]] = {
    request.function_code: request
    for request in (
        ReadCoilsRequest,
        ReadDiscreteInputsRequest,
        ReadHoldingRegistersRequest,
        ReadInputRegistersRequest,
    )
}
_MEI_TYPE = b"\x0e"
_IDENTIFICATION_HEAD = 5
_MAX_RTU_FRAME = 256


def read(function: int, address: int, count: int) -> bytes:
    """FC 1 to 4. ValueError if one request cannot read as many."""
    return _bytes_of(_READING[function](address=address, count=count))


def write_coil(address: int, on: bool) -> bytes:
    """FC 5."""
    return _bytes_of(WriteSingleCoilRequest(address=address, bits=[on]))


def write_register(address: int, data: bytes) -> bytes:
    """FC 6."""
    return _bytes_of(WriteSingleRegisterRequest(address=address, registers=_registers(data)))


def write_coils(address: int, bits: tuple[bool, ...]) -> bytes:
    """FC 15."""
    return _bytes_of(WriteMultipleCoilsRequest(address=address, bits=bits))


def write_registers(address: int, data: bytes) -> bytes:
    """FC 16."""
    return _bytes_of(WriteMultipleRegistersRequest(address=address, registers=_registers(data)))


def mask_register(address: int, and_mask: int, or_mask: int) -> bytes:
    """FC 22."""
    return _bytes_of(MaskWriteRegisterRequest(address=address, and_mask=and_mask, or_mask=or_mask))


def read_write(read_address: int, count: int, write_address: int, data: bytes) -> bytes:
    """FC 23. ValueError if one request cannot read or write as many."""
    request = ReadWriteMultipleRegistersRequest(
        read_address=read_address,
        read_count=count,
        write_address=write_address,
        write_registers=_registers(data),
    )
    return _bytes_of(request)


def read_identification(code: int, object_id: int) -> bytes:
    """FC 43 with MEI type 14."""
    return _bytes_of(ReadDeviceInformationRequest(read_code=code, object_id=object_id))


def crc(data: bytes | bytearray) -> bytes:
    """The check of an RTU frame, as it goes over the line: low byte first (Serial Line V1.02, 2.5.1.2)."""
    return FramerRTU.compute_CRC(bytes(data)).to_bytes(2, "big")


def identification_frame_size(frame: bytes | bytearray) -> int:
    """Bytes of an RTU frame with an answer of FC 43 that begins with `frame`; more than 256: not known yet."""
    size = ReadDeviceInformationResponse.calculateRtuFrameSize(bytes(frame))
    return size if size <= _MAX_RTU_FRAME else _MAX_RTU_FRAME + 1


def identification(data: bytes) -> tuple[dict[int, bytes], int | None]:
    """Objects of an answer of FC 43 (its PDU behind the MEI type), and the id to go on with, if more follows.

    ValueError for what is no such answer.
    """
    if len(data) < _IDENTIFICATION_HEAD:
        raise ValueError(f"an identification of length {len(data)}")
    answer = ReadDeviceInformationResponse()
    try:
        answer.decode(_MEI_TYPE + data)
    except Exception as error:
        raise ValueError(f"an identification that cannot be read: {error}") from error
    objects = {
        number: content if isinstance(content, bytes) else b"".join(content)
        for number, content in answer.information.items()
    }
    return objects, answer.next_object_id if answer.more_follows else None


def _bytes_of(request: ModbusPDU) -> bytes:
    return bytes((request.function_code,)) + request.encode()


def _registers(data: bytes) -> list[int]:
    return list(unpack(f">{len(data) // 2}H", data))

"""What is answered on the wire, request by request: Application Protocol V1.1b3, 6 and 7, and our refusals."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

import pytest

from gatewayd import __version__
from gatewayd.links.modbus_server.listener import ModbusListener

Ask = Callable[..., Awaitable[str]]

PLC, HMI, UNDECLARED = "127.0.0.2", "127.0.0.3", "127.0.0.1"

READS = [
    ("01 0000 000a", "01 02 00 00", "coils"),
    ("01 0000 0001", "01 01 00", "one coil"),
    ("01 0000 000b", "01 02 00 00", "coils up to the last one"),
    ("01 0000 000c", "81 02", "one coil too many, though it would fit into the last byte"),
    ("01 000b 0001", "81 02", "a coil that is not there"),
    ("01 0000 0000", "81 03", "no coil"),
    ("01 0000 07d1", "81 03", "2001 coils"),
    ("01 0000 07d0", "81 02", "2000 coils: the quantity is legal, the range is not"),
    ("01 0000", "81 03", "a coil request cut short"),
    ("01 0000 0001 00", "81 03", "a coil request with a byte too many"),
    ("02 0003 0020", "02 04 00 00 00 00", "discrete inputs"),
    ("02 0002 0002", "82 02", "discrete inputs from before the first one"),
    ("02 0003 0000", "82 03", "no discrete input"),
    ("02 0003 07d1", "82 03", "2001 discrete inputs"),
    ("03 0000 0001", "03 02 00 00", "a register of bits"),
    ("03 000a 0008", "03 10" + " 00" * 16, "registers of several variables"),
    ("03 00c8 0060", "03 c0" + " 00" * 192, "96 registers"),
    ("03 0001 0001", "83 02", "a register that is not there"),
    ("03 0010 0003", "83 02", "registers that go over the last mapped one"),
    ("03 0000 0000", "83 03", "no register"),
    ("03 0000 007e", "83 03", "126 registers"),
    ("03 0001 0000", "83 03", "quantity is checked before the address"),
    ("03 ffff 0001", "83 02", "the last address"),
    ("03 ffff 007d", "83 02", "registers that go over the last address"),
    ("03 0000", "83 03", "a register request cut short"),
    ("03 0000 0001 00", "83 03", "a register request with a byte too many"),
    ("04 0000 0030", "04 60" + " 00" * 96, "input registers"),
    ("04 0000 0031", "84 02", "one input register too many"),
    ("04 0000 007e", "84 03", "126 input registers"),
    ("03 ea60 0001", "03 02 00 01", "the status block among the holding registers"),
    ("04 ea60 0001", "04 02 00 01", "the status block among the input registers"),
    ("03 fd1f 0001", "03 02 00 00", "the last word of the status block"),
    ("03 fd1f 0002", "83 02", "registers that go over the end of the status block"),
    ("03 ea5f 0002", "83 02", "registers that go into the status block"),
]

WRITES = [
    ("05 0000 ff00", "05 00 00 ff 00", "a coil on"),
    ("05 0000 0000", "05 00 00 00 00", "a coil off"),
    ("05 0000 0001", "85 03", "a coil neither on nor off"),
    ("05 00ff 1234", "85 03", "a coil's value is checked before its address"),
    ("05 00ff ff00", "85 02", "a coil that is not there"),
    ("05 000a ff00", "85 02", "a coil that the robot sends"),
    ("05 0000 ff", "85 03", "a coil write cut short"),
    ("06 000a 0017", "06 00 0a 00 17", "one register"),
    ("06 000b 0001", "86 03", "one register of two"),
    ("06 0064 0001", "86 02", "a register that the robot sends"),
    ("06 0001 0001", "86 02", "a register that is not there"),
    ("06 000d 05dc", "06 00 0d 05 dc", "a scaled value on its limit"),
    ("06 000d 05dd", "86 03", "a scaled value over its limit"),
    ("06 000d ffff", "86 03", "a scaled value under its limit"),
    ("06 000a", "86 03", "a register write cut short"),
    ("06 0000 0001", "06 00 00 00 01", "a register of bits, one's own changed"),
    ("06 0000 8003", "86 02", "a register of bits, with a bit that only another may write"),
    ("06 0000 7ffd", "86 02", "ones in bits that are not mapped"),
    ("10 0000 0001 02 0005", "90 02", "several registers, with a one in a bit that is not mapped"),
    ("06 0014 0001", "06 00 14 00 01", "a register of bits, with one that the robot sends left alone"),
    ("06 0014 0003", "86 02", "a register of bits, with one that the robot sends changed"),
    ("0f 0000 000a 02 ff03", "0f 00 00 00 0a", "coils"),
    ("0f 0000 000a 01 ff", "8f 03", "coils with a byte too few"),
    ("0f 0000 000a 02 ff", "8f 03", "coils cut short"),
    ("0f 0000 0000 00", "8f 03", "no coil"),
    ("0f 0000 07b1 f7" + "00" * 247, "8f 03", "1969 coils"),
    ("0f 0000 07b0 f6" + "00" * 246, "8f 02", "1968 coils: the quantity is legal, the range is not"),
    ("0f 0009 0003 01 00", "8f 02", "coils that go over the last one"),
    ("0f 0009 0002 01 00", "8f 02", "coils with one that the robot sends"),
    ("10 000b 0002 04 fffffffe", "10 00 0b 00 02", "a value of two registers"),
    ("10 000a 0003 06 000100000002", "10 00 0a 00 03", "two values"),
    ("10 000a 0002 04 00010000", "90 03", "a value and half of the next one"),
    ("10 000c 0002 04 00000001", "90 03", "half of a value and the next one"),
    ("10 000a 0000 00", "90 03", "no register"),
    ("10 000a 007c f8" + "00" * 247, "90 03", "124 registers, more than a frame can hold"),
    ("10 000a 007b f6" + "00" * 246, "90 02", "123 registers: the quantity is legal, the range is not"),
    ("10 000a 0001 03 000100", "90 03", "registers with an odd number of bytes"),
    ("10 000a 0001 02 00", "90 03", "registers cut short"),
    ("10 000a 0001", "90 03", "registers without a byte count"),
    ("10 0010 0003 06 000000000000", "90 02", "an address that is not there counts before half a value"),
    ("10 0063 0003 06 000000000000", "90 02", "the same for values of the robot"),
    ("06 ea88 0001", "06 ea 88 00 01", "asking for a lock"),
    ("06 ea88 0002", "86 02", "asking for a lock that only another may own"),
    ("06 ea88 03e7", "86 03", "asking for the lock of a variable that is not there"),
    ("10 ea88 0002 04 00000001", "10 ea 88 00 02", "giving a lock back"),
    ("10 ea88 0002 04 00010001", "90 03", "asking for a lock and giving one back at once"),
    ("06 ea60 0001", "86 02", "any other word of the status block"),
    ("16 ea88 0000 0001", "16 ea 88 00 00 00 01", "asking for a lock by a mask"),
]

MASKS = [
    ("16 000a 00f2 0025", "16 00 0a 00 f2 00 25", "a register"),
    ("16 0000 fffe 0001", "16 00 00 ff fe 00 01", "one bit of a register"),
    ("16 0000 fffd 0002", "96 02", "a bit that only another may write"),
    ("16 0014 fffd 0002", "96 02", "a bit that the robot sends"),
    ("16 0000 fffb 0004", "96 02", "a bit that is not mapped"),
    ("16 0000 fffb 0000", "96 02", "a bit that is not mapped, and is 0 already"),
    ("16 0000 fffa 0005", "96 02", "a one in a bit that is not mapped, beside one that is"),
    ("16 0000 ffff ffff", "16 00 00 ff ff ff ff", "no bit"),
    ("16 000b 0000 0001", "96 03", "one register of two"),
    ("16 01f4 0000 0001", "96 02", "a register that the robot sends"),
    ("16 0001 0000 0001", "96 02", "a register that is not there"),
    ("16 000a 00f2", "96 03", "a mask cut short"),
    ("16 000a 00f2 0025 00", "96 03", "a mask with a byte too many"),
]

READ_WRITES = [
    ("17 000a 0001 000a 0001 02 0007", "17 02 00 07", "the write comes first"),
    ("17 0064 0002 000a 0001 02 0007", "17 04 00 00 00 00", "another range is read"),
    ("17 0001 0001 000a 0001 02 0007", "97 02", "the range to be read is not there"),
    ("17 000a 0001 0001 0001 02 0007", "97 02", "the range to be written is not there"),
    ("17 000a 0000 000a 0001 02 0007", "97 03", "nothing to be read"),
    ("17 000a 007e 000a 0001 02 0007", "97 03", "126 registers to be read"),
    ("17 000a 0001 000a 0000 00", "97 03", "nothing to be written"),
    ("17 000a 0001 000a 007a f4" + "00" * 243, "97 03", "122 registers to be written"),
    ("17 000a 0001 000a 0001 03 000700", "97 03", "a wrong byte count"),
    ("17 000a 0001 000a 0001 02 00", "97 03", "a read and write cut short"),
    ("17 000a 0001", "97 03", "a read without a write"),
    ("17 ea60 0001 ea88 0001 02 0001", "17 02 00 01", "the status block on both sides"),
]

SERVER_ID = bytes((2 + len(_text := f"gatewayd {__version__} press-3".encode()), 1, 0xFF)) + _text

OTHERS = [
    *(
        (f"{function:02x}", f"{function | 0x80:02x} 01", f"function {function}")
        for function in (0, 7, 11, 12, 100)
    ),
    ("08 0000 1234", "08 00 00 12 34", "query data are returned"),
    ("08 0000", "08 00 00", "no query data"),
    ("08 0000 1234 5678 9abc", "08 00 00 12 34 56 78 9a bc", "much query data"),
    ("08 0000 12", "88 03", "half a word of query data"),
    ("08", "88 03", "diagnostics without a sub-function"),
    ("08 0001 0000", "88 01", "restart communications"),
    ("08 000b 0000", "88 01", "a counter of a serial line"),
    ("11", "11 " + SERVER_ID.hex(" "), "the server and whether it runs"),
    ("11 00", "91 03", "a question for the server with a byte too many"),
    ("14 07 06 0004 0001 0002", "94 01", "file records"),
    ("18 04de", "98 01", "a FIFO queue"),
    ("83 00", "83 01", "a function with the bit of an exception"),
    ("2b 0d 00", "ab 01", "CANopen inside Modbus"),
    ("2b", "ab 03", "identification without a type"),
    ("2b 0e 01", "ab 03", "identification cut short"),
    ("2b 0e 00 00", "ab 03", "identification with a code of 0"),
    ("2b 0e 05 00", "ab 03", "identification with a code of 5"),
    ("2b 0e 04 60", "ab 02", "an object that is not there"),
    ("2b 0e 04 05", "2b 0e 04 83 00 00 01 05 07 70 72 65 73 73 2d 33", "the name of the cell"),
]

EVERYTHING = READS + WRITES + MASKS + READ_WRITES + OTHERS


@pytest.mark.parametrize(
    "request_pdu,answer",
    [case[:2] for case in EVERYTHING],
    ids=[f"{case[0][:2]}-{case[2]}" for case in EVERYTHING],
)
async def test_request_has_its_answer(ask: Ask, request_pdu: str, answer: str) -> None:
    assert await ask(request_pdu, PLC) == answer


async def test_mask_follows_the_example_of_the_specification(ask: Ask) -> None:
    await ask("06 000a 0012")
    await ask("16 000a 00f2 0025")
    assert await ask("03 000a 0001") == "03 02 00 17"


@pytest.mark.parametrize("unit", [0, 1, 255])
async def test_the_only_unit_answers_to_the_ids_of_the_device_itself(ask: Ask, unit: int) -> None:
    assert await ask("03 0000 0001", unit=unit) == "03 02 00 00"
    assert await ask("01 0000 0001", unit=unit) == "01 01 00"


@pytest.mark.parametrize("pdu", ["03 0000 0001", "06 000a 0001", "07", "2b 0e 01 00"])
async def test_an_unknown_unit_does_not_respond(ask: Ask, pdu: str) -> None:
    assert await ask(pdu, unit=2) == f"{int(pdu[:2], 16) | 0x80:02x} 0b"


@pytest.mark.parametrize(
    "pdu", ["05 0000 ff00", "06 000a 0001", "06 0000 0000", "06 ea88 0001", "16 000a 0000 0000"]
)
async def test_a_peer_that_is_no_writer_may_only_read(ask: Ask, pdu: str) -> None:
    """Not even what is there already: success must not depend on the value."""
    assert await ask(pdu, UNDECLARED) == f"{int(pdu[:2], 16) | 0x80:02x} 02"
    assert await ask("03 000a 0001", UNDECLARED) == "03 02 00 00"


async def test_what_another_owns_is_busy(ask: Ask) -> None:
    assert await ask("05 0003 ff00", PLC) == "05 00 03 ff 00"
    assert await ask("05 0003 0000", HMI) == "85 06"
    assert await ask("0f 0002 0003 01 07", HMI) == "8f 06"
    assert await ask("01 0002 0003", HMI) == "01 01 02", "nothing of the refused request was applied"


async def test_a_higher_writer_takes_over(ask: Ask) -> None:
    assert await ask("06 000a 0005", HMI) == "06 00 0a 00 05"
    assert await ask("06 000a 0006", PLC) == "06 00 0a 00 06"
    assert await ask("06 000a 0007", HMI) == "86 06"


async def test_each_writer_has_its_bit_of_a_register(ask: Ask) -> None:
    assert await ask("06 0000 0001", PLC) == "06 00 00 00 01"
    assert await ask("06 0000 0003", HMI) == "06 00 00 00 03"
    assert await ask("16 0000 fffe 0000", HMI) == "96 02"
    assert await ask("16 0000 fffe 0000", PLC) == "16 00 00 ff fe 00 00"
    assert await ask("03 0000 0001", PLC) == "03 02 00 02"


@pytest.mark.parametrize(
    "frame",
    [
        "0001 0001 0006 01 03 0000 0001",
        "0001 0000 0000 01 03 0000 0001",
        "0001 0000 0001 01 03 0000 0001",
        "0001 0000 00ff 01 03 0000 0001",
        "0001 0000 ffff 01 03 0000 0001",
    ],
    ids=["protocol id 1", "length 0", "length 1", "length 255", "length 65535"],
)
async def test_what_is_no_frame_closes_the_connection(listener: ModbusListener, frame: str) -> None:
    """After the requests before it were answered: where the next frame begins cannot be known."""
    reader, writer = await asyncio.open_connection("127.0.0.1", listener.port)
    writer.write(bytes.fromhex("0007 0000 0006 01 03 0000 0001") + bytes.fromhex(frame))
    assert await reader.read() == bytes.fromhex("0007 0000 0005 01 03 02 0000")
    writer.close()


async def test_the_greatest_frame_is_answered(ask: Ask) -> None:
    assert await ask("10 000a 007b f6" + "00" * 246) == "90 02"
    assert await ask("41" + "00" * 252) == "c1 01"

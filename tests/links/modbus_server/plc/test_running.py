"""The tables of every target, run: C that is made from them reads and writes a gateway, and means what it means.

So does the structured text, put into C statement by statement.
"""

from __future__ import annotations

import asyncio
import math
import random
import shutil
import struct
import subprocess
import time
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path

import pytest

from gatewayd.core.cell import Cell
from gatewayd.core.definition import Direction, Value, ValueKind
from gatewayd.links.modbus_server.listener import ModbusListener
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.links.modbus_server.plc.build import model_of
from gatewayd.links.modbus_server.plc.model import PlcModel
from gatewayd.links.modbus_server.plc.registry import files_for
from gatewayd.mapping.plan import Plan
from gatewayd.modbus.codec import TYPES, make_codec
from gatewayd.plc.model import Tag
from gatewayd.plc.tags import PlcWishes
from tests.links.modbus_server.plc.cells import complete_plan
from tests.links.modbus_server.plc.logix_translation import header as logix
from tests.links.modbus_server.plc.translation import header

COMPILER = shutil.which("cc")
ROUNDS = 20

pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C compiler")

MAIN = """
#include <stdio.h>
#include "gw.h"
static struct gw_image image;
static struct gw_inputs inputs;
static struct gw_outputs outputs;
int main(int count, char **arguments)
{
    (void)arguments;
    unsigned word;
    if (count > 1) {
%(read)s
        gw_unpack(&image, &outputs);
%(show)s
    } else {
%(take)s
        gw_pack(&inputs, &image);
%(write)s
    }
    return 0;
}
"""

_UNSIGNED = ("%llu", "unsigned long long", "%llu")
_SIGNED = ("%lld", "long long", "%lld")
_REAL = ("%.17g", "double", "%lf")
FORMATS = {
    **dict.fromkeys(("BOOL", "USINT", "UINT", "UDINT", "ULINT"), _UNSIGNED),
    **dict.fromkeys(("SINT", "INT", "DINT", "LINT"), _SIGNED),
    **dict.fromkeys(("REAL", "LREAL"), _REAL),
}
"""Type of a tag -> how a number is printed, its type in C, how it is read."""


def number_of(text: str, tag: Tag) -> Value:
    """As the robot's type: a scaled whole number is a real in the PLC, a real in an integer register is an integer."""
    number = float(text) if FORMATS[tag.type] is _REAL else int(text)
    return float(number) if tag.kind is ValueKind.FLOAT else round(number)


def text_of(value: Value | None, tag: Tag) -> str:
    return f"{value:.17g}" if FORMATS[tag.type] is _REAL else str(int(value or 0))


def source(model: PlcModel) -> str:
    """A program that knows every number by the type of its tag."""
    return MAIN % {
        "read": "".join(
            f"for (int i = 0; i < {poll.count}; i++)\n"
            f'{{ if (scanf("%x", &word) != 1) return 1;\nimage.{poll.name}[i] = (uint16_t)word; }}\n'
            for poll in model.reads
        ),
        "write": "".join(
            f'for (int i = 0; i < {poll.count}; i++)\nprintf("%04x\\n", (uint16_t)image.{poll.name}[i]);\n'
            for poll in model.writes
        ),
        "show": "".join(
            f'printf("{FORMATS[tag.type][0]}\\n", ({FORMATS[tag.type][1]})outputs.{tag.path});\n'
            for tag in tags_of(model, Direction.OUTPUT)
        ),
        "take": "".join(
            f"{{ {FORMATS[tag.type][1]} number;\n"
            f'if (scanf("{FORMATS[tag.type][2]}", &number) != 1) return 1;\ninputs.{tag.path} = number; }}\n'
            for tag in tags_of(model, Direction.INPUT)
        ),
    }


def program(folder: Path, model: PlcModel, target: str = "c") -> Path:
    """A compiled PLC: with an argument it decodes words, without one it encodes numbers."""
    (made,) = files_for("c", model)
    texts = {
        "c": lambda: made.content().decode(),
        "iec-st": lambda: header(model),
        "studio5000": lambda: logix(model),
    }
    (folder / "gw.h").write_text(texts[target]())
    (folder / "main.c").write_text(source(model))
    binary = folder / "plc"
    warnings = ["-Wall", "-Werror", "-Wno-unused-but-set-variable", "-Wno-unused-function"]
    command = [COMPILER or "", "-std=gnu99", *warnings, "-O0", "main.c", "-o", str(binary), "-lm"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return binary


def run(binary: Path, *arguments: str, text: str) -> list[str]:
    return subprocess.run(
        [binary, *arguments], input=text, capture_output=True, text=True, check=True
    ).stdout.split()


class Gateway:
    """A cell on a listener, and a connection of the PLC to it."""

    def __init__(self, plan: Plan, cell: Cell) -> None:
        self.plan, self.cell = plan, cell
        self.codecs = {place.variable: place.codec for place in plan.the(ModbusPlan).placements}

    async def connect(self, port: int) -> None:
        self.reader, self.writer = await asyncio.open_connection("127.0.0.1", port)

    async def ask(self, pdu: bytes) -> bytes:
        self.writer.write(struct.pack(">HHHB", 1, 0, len(pdu) + 1, 1) + pdu)
        head = await self.reader.readexactly(7)
        return await self.reader.readexactly(struct.unpack(">HHHB", head)[2] - 1)

    async def read(self, model: PlcModel) -> list[int]:
        """All words that the poll plan reads, in its order."""
        found: list[int] = []
        for poll in model.reads:
            answer = await self.ask(struct.pack(">BHH", poll.function, poll.address, poll.count))
            assert answer[0] == poll.function
            found += struct.unpack(f">{poll.count}H", answer[2:])
        return found

    async def write(self, model: PlcModel, words: list[int]) -> None:
        """All words that the poll plan writes, in its order."""
        for poll in model.writes:
            mine, words = words[: poll.count], words[poll.count :]
            head = struct.pack(">BHHB", poll.function, poll.address, poll.count, 2 * poll.count)
            answer = await self.ask(head + struct.pack(f">{poll.count}H", *mine))
            assert answer[0] == poll.function, answer.hex()

    def means(self, tag: Tag, value: Value) -> Value | None:
        """What the gateway reads of a register that is written to mean a value."""
        codec = self.codecs[tag.number - 1]
        return bool(value) if codec is None else codec.decode(codec.encode(value))

    def shows(self, tag: Tag, value: Value) -> Value | None:
        """What a register shows of a value: one at the end of the robot's type is no declared limit there."""
        codec, form = self.codecs[tag.number - 1], tag.encoding
        if codec is None or form is None:
            return bool(value)
        plain = make_codec(form.type, form.order, kind=tag.kind, scale=form.scale, offset=form.offset)
        return plain.decode(codec.encode(value))


@pytest.fixture
async def gateway() -> AsyncIterator[Gateway]:
    plan = complete_plan()
    cell = Cell(plan.cell)
    now = time.monotonic()
    cell.robot_connected(now)
    cell.adopt({}, now)
    cell.package_arrived(1.0, now)
    cell.outputs_written(now)
    cell.freshness.stale_after = 3600.0
    listener = ModbusListener("127.0.0.1", 0, observe=lambda _event: None)
    listener.serve([(plan.the(ModbusPlan), cell)])
    await listener.start()
    gateway = Gateway(plan, cell)
    await gateway.connect(listener.port)
    yield gateway
    gateway.writer.close()
    await listener.close()


def drawn(tag: Tag, random_of: random.Random) -> Value:
    """A value that the register can show, or one at or beyond its ends."""
    if tag.kind is ValueKind.BOOL:
        return random_of.random() < 0.5
    if tag.encoding is None or tag.encoding.type == "bool":
        return random_of.choice([0, 1])
    number = TYPES[tag.encoding.type]
    low, high = (-1e30, 1e30) if number.is_real else (number.low, number.high)
    raw = random_of.choice([random_of.uniform(low, high), random_of.uniform(-1e3, 1e3), low, high, 0.0])
    value = raw * tag.encoding.scale + tag.encoding.offset
    return round(max(-(1 << 31), min((1 << 31) - 1, value))) if tag.kind is ValueKind.INT else value


def rough(tag: Tag) -> float:
    """What arithmetic in REAL may be off, relatively."""
    return 1e-6 if tag.arithmetic == "REAL" else 0 if not tag.arithmetic else 1e-15


def is_same(one: Value | None, other: Value | None, tag: Tag, digits: float) -> bool:
    """Whether two values are the same but for so much, also where an offset brings them near 0."""
    offset = abs(tag.encoding.offset) if tag.encoding is not None else 0.0
    return (
        one is not None
        and other is not None
        and math.isclose(one, other, rel_tol=digits, abs_tol=offset * digits)
    )


def tags_of(model: PlcModel, direction: Direction) -> list[Tag]:
    members = model.inputs if direction is Direction.INPUT else model.outputs
    return [tag for member in members for tag in member.tags]


@pytest.mark.parametrize("target", ["c", "iec-st", "studio5000"])
async def test_what_the_program_reads_is_what_the_gateway_means(
    gateway: Gateway, tmp_path: Path, target: str
) -> None:
    """All types, orders and scales; random values, over a socket. A scaled REAL has its own seven digits."""
    model = model_of(gateway.plan, PlcWishes())
    binary = program(tmp_path, model, target)
    random_of = random.Random(1)
    tags = tags_of(model, Direction.OUTPUT)
    for _round in range(ROUNDS):
        values = [drawn(tag, random_of) for tag in tags]
        for tag, value in zip(tags, values, strict=True):
            gateway.cell.image.values[tag.number - 1] = value
        gateway.cell.outputs_written(time.monotonic())
        words = await gateway.read(model)
        shown = run(binary, "read", text=" ".join(f"{word:x}" for word in words))
        for tag, value, text in zip(tags, values, shown, strict=True):
            digits = 0 if target == "c" else rough(tag)
            shown_value = gateway.shows(tag, value)
            assert is_same(number_of(text, tag), shown_value, tag, digits), (tag, text, value)


@pytest.mark.parametrize("target", ["c", "iec-st", "studio5000"])
async def test_what_the_program_writes_is_what_the_robot_gets(
    gateway: Gateway, tmp_path: Path, target: str
) -> None:
    """The same in the other direction."""
    model = model_of(gateway.plan, PlcWishes())
    binary = program(tmp_path, model, target)
    random_of = random.Random(2)
    tags = tags_of(model, Direction.INPUT)
    for _round in range(ROUNDS):
        values = [gateway.means(tag, drawn(tag, random_of)) for tag in tags]
        words = run(binary, text=" ".join(map(text_of, values, tags)))
        await gateway.write(model, [int(word, 16) for word in words])
        for tag, value in zip(tags, values, strict=True):
            digits = 0 if target == "c" else rough(tag)
            given = gateway.cell.image.values[tag.number - 1]
            assert is_same(given, value, tag, digits), (tag, given, value)


async def test_a_wrong_word_order_is_found(gateway: Gateway, tmp_path: Path) -> None:
    """Of one variable alone, so that nothing but its words can be the reason."""
    model = model_of(gateway.plan, PlcWishes())
    wrong = next(
        tag
        for tag in tags_of(model, Direction.OUTPUT)
        if tag.encoding is not None
        and (tag.encoding.type, tag.encoding.order) == ("float32", "ABCD")
        and tag.kind is ValueKind.FLOAT
    )
    assert wrong.encoding is not None
    order = replace(wrong.encoding, order="CDAB")
    polls = tuple(
        replace(poll, tags=tuple(replace(tag, encoding=order) if tag is wrong else tag for tag in poll.tags))
        for poll in model.polls
    )
    binary = program(tmp_path, replace(model, polls=polls))
    gateway.cell.image.values[wrong.number - 1] = math.pi
    gateway.cell.outputs_written(time.monotonic())
    words = await gateway.read(model)
    shown = run(binary, "read", text=" ".join(f"{word:x}" for word in words))
    tags = tags_of(model, Direction.OUTPUT)
    differing = [
        tag.name
        for tag, text in zip(tags, shown, strict=True)
        if number_of(text, tag) != gateway.shows(tag, gateway.cell.image.values[tag.number - 1])
    ]
    assert differing == [wrong.name]

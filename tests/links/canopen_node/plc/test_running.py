"""The tables of every target, run: C that is made from them reads and makes the frames of a node.

What it understands is what the node means. So it is with the structured text, put into C statement by statement.
"""

from __future__ import annotations

import math
import random
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from gatewayd.canopen.bus import BusState
from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.frame import Frame
from gatewayd.core.cell import Cell
from gatewayd.core.definition import Direction, Value, ValueKind
from gatewayd.links.canopen_node.node import Node
from gatewayd.links.canopen_node.plan import CanopenPlan
from gatewayd.links.canopen_node.plc.blocks import data_types, pack, unpack
from gatewayd.links.canopen_node.plc.build import model_of
from gatewayd.links.canopen_node.plc.model import PdoModel, PdoTag
from gatewayd.links.canopen_node.plc.registry import files_for
from gatewayd.links.canopen_node.plc.targets.iec_st import CONTENT, DIALECT
from gatewayd.links.canopen_node.store import Store
from gatewayd.links.canopen_values import fit, meaning
from gatewayd.plc.model import TagFamily
from gatewayd.plc.st.convert import functions
from gatewayd.plc.tags import PlcWishes
from tests.links.canopen_node.plc.cells import complete_plan
from tests.links.canopen_node.wire import Wire
from tests.links.modbus_server.plc.translation import PACKING, UNPACKING, TranslatedBlock, translated

COMPILER = shutil.which("cc")
ROUNDS = 20

pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C compiler")

MAIN = """
#include <stdio.h>
#include "gw.h"
static struct gw_from_node from_node;
static struct gw_to_node to_node;
static struct gw_inputs inputs;
static struct gw_outputs outputs;
int main(int count, char **arguments)
{
    (void)arguments;
    unsigned byte;
    if (count > 1) {
%(read)s
        gw_unpack(&from_node, &outputs);
%(show)s
    } else {
%(take)s
        gw_pack(&inputs, &to_node);
%(write)s
    }
    return 0;
}
"""
UNSIGNED, SIGNED, REAL = ("%llu", "unsigned long long"), ("%lld", "long long"), ("%.17g", "double")
FORMATS = {
    **dict.fromkeys(("BOOL", "USINT", "UINT", "UDINT", "ULINT"), UNSIGNED),
    **dict.fromkeys(("SINT", "INT", "DINT", "LINT"), SIGNED),
    **dict.fromkeys(("REAL", "LREAL"), REAL),
}
"""Type of a tag -> how a number is printed, and its type in C."""


def tags_of(families: Sequence[TagFamily]) -> list[PdoTag]:
    return [tag for family in families for tag in family.tags if isinstance(tag, PdoTag)]


def source(model: PdoModel) -> str:
    """A program that knows every number by the type of its tag."""
    status = [word for pdo in model.from_node for word in pdo.words]
    return MAIN % {
        "read": "".join(
            f"for (int i = 0; i < {pdo.size}; i++)\n"
            f'{{ if (scanf("%x", &byte) != 1) return 1; from_node.{pdo.name}[i] = (uint8_t)byte; }}\n'
            for pdo in model.from_node
        ),
        "show": "".join(
            f'printf("{FORMATS[tag.type][0]}\\n", ({FORMATS[tag.type][1]})outputs.{tag.path});\n'
            for tag in tags_of(model.outputs)
        )
        + "#ifdef GW_FINGERPRINT\nstruct gw_status status; gw_decode_status(&from_node, &status);\n"
        + "".join(f'printf("%lu\\n", (unsigned long)status.{word.object_name});\n' for word in status)
        + "#endif\n",
        "take": "".join(
            f"{{ {FORMATS[tag.type][1]} number;\n"
            f'if (scanf("{FORMATS[tag.type][0].replace(".17g", "lf")}", &number) != 1) return 1;\n'
            f"inputs.{tag.path} = number; }}\n"
            for tag in tags_of(model.inputs)
        ),
        "write": "".join(
            f'for (int i = 0; i < {pdo.size}; i++) printf("%02x\\n", to_node.{pdo.name}[i]);\n'
            for pdo in model.to_node
        ),
    }


def text_as_c(model: PdoModel) -> str:
    """The very lines of `iec-st`."""
    from_node, to_node = "struct gw_from_node *from_node", "struct gw_to_node *to_node"
    blocks = (
        TranslatedBlock(
            unpack(model, DIALECT, CONTENT), f"{from_node}, struct gw_outputs *outputs", UNPACKING
        ),
        TranslatedBlock(pack(model, DIALECT, CONTENT), f"struct gw_inputs *inputs, {to_node}", PACKING),
    )
    types = data_types(model, DIALECT, CONTENT)
    return translated(types, functions(model, DIALECT, of_bytes=True), blocks)


def program(folder: Path, model: PdoModel, target: str = "c") -> Path:
    """A compiled master's program: with an argument it decodes bytes, without one it encodes numbers."""
    (made,) = files_for("c", model)
    (folder / "gw.h").write_text(made.content().decode() if target == "c" else text_as_c(model))
    (folder / "main.c").write_text(source(model))
    warnings = ["-Wall", "-Werror", "-Wno-unused-but-set-variable", "-Wno-unused-function"]
    command = [COMPILER or "", "-std=gnu99", *warnings, "-O0", "main.c", "-o", "plc", "-lm"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder / "plc"


def run(binary: Path, *arguments: str, text: str) -> list[str]:
    return subprocess.run(
        [binary, *arguments], input=text, capture_output=True, text=True, check=True
    ).stdout.split()


class Bus:
    """A node in OPERATIONAL over the complete cell, with a robot that is connected."""

    def __init__(self) -> None:
        self.now = 100.0
        self.plan = complete_plan()
        self.model = model_of(self.plan, PlcWishes())
        self.wire = Wire()
        self.cell = Cell(self.plan.cell)
        self.cell.robot_connected(self.now)
        inputs = [v for v in self.plan.cell.variables if v.direction is Direction.INPUT]
        self.cell.adopt({variable.number - 1: 0 for variable in inputs}, self.now)
        self.cell.package_arrived(1.0, self.now)
        self.node = Node(self.plan.the(CanopenPlan), self.cell, self.wire.send, Store(), lambda _now: True)
        self.cell.listeners.append(lambda direction: self.node.image_changed(direction, self.now))
        self.latest: dict[int, bytes] = {}
        self.node.bus_changed(BusState.ACTIVE, self.now)
        self.node.start(self.now)
        self._listen()

    def _listen(self) -> None:
        self.latest |= {frame.can_id: frame.data for frame in self.wire.take()}

    def show(self, values: dict[int, Value]) -> None:
        """The robot reports values; number of the variable -> value."""
        for number, value in values.items():
            self.cell.image.values[number - 1] = value
        self.now += 1
        self.cell.outputs_written(self.now)
        self.node.tick(self.now)
        self._listen()

    def octets(self) -> str:
        """What the master has heard last, in the order of the program."""
        frames = [self.latest[pdo.cob_id] for pdo in self.model.from_node]
        return " ".join(f"{octet:x}" for frame in frames for octet in frame)

    def send(self, octets: list[str]) -> None:
        """RPDOs of these bytes."""
        for pdo in self.model.to_node:
            mine, octets = octets[: pdo.size], octets[pdo.size :]
            self.node.receive(Frame(pdo.cob_id, bytes(int(octet, 16) for octet in mine)), self.now)

    def means(self, tag: PdoTag, value: Value) -> Value | None:
        """What the gateway makes of the object that is nearest to a value."""
        item = next(each for each in self.plan.the(CanopenPlan).objects if each.variable == tag.number - 1)
        raw = item.type.unpack(item.type.pack(fit(value, item.type, item.linear)))
        return meaning(tag.kind, item.linear)(raw)


@cache
def bounds(tag: PdoTag) -> tuple[float, float]:
    """Between which values the object can hold all, and the robot's type too."""
    if tag.encoding is None or tag.kind is ValueKind.BOOL:
        return 0, 1
    name = tag.type_in_mapping(tag.encoding.type)
    can_type = CanType[name]
    low, high = (-1e30, 1e30) if can_type.is_real else can_type.bounds
    # A double knows no integer between the greatest ones of 64 bits.
    low, high = max(low, -(1 << 52)), min(high, 1 << 52)
    ends = sorted(raw * tag.encoding.scale + tag.encoding.offset for raw in (low, high))
    if tag.kind is ValueKind.INT:
        # What is nearest to the end of the robot's type is read as that end: not what is meant here.
        near = (1 << 31) - 1000
        return max(math.ceil(ends[0]), -near), min(math.floor(ends[1]), near)
    return ends[0], ends[1]


def drawn(tag: PdoTag, draw: random.Random) -> Value:
    low, high = bounds(tag)
    if tag.kind is ValueKind.BOOL:
        return draw.random() < 0.5
    if tag.kind is ValueKind.INT:
        return draw.choice((int(low), int(high), draw.randint(int(low), int(high))))
    return draw.choice((low, high, draw.uniform(low, high), draw.uniform(max(low, -300), min(high, 300))))


def number_of(text: str, tag: PdoTag) -> Value:
    number = float(text) if FORMATS[tag.type] is REAL else int(text)
    return float(number) if tag.kind is ValueKind.FLOAT else round(number)


def text_of(value: Value, tag: PdoTag) -> str:
    return f"{value:.17g}" if FORMATS[tag.type] is REAL else str(round(value))


def is_same(one: Value | None, other: Value | None, tag: PdoTag, digits: float) -> bool:
    """Equal, as far as the numbers of the target are precise; `digits`: relative error of a REAL there."""
    if one is None or other is None:
        return one == other
    if not digits or tag.arithmetic != "REAL":
        return one == other or math.isclose(one, other, rel_tol=1e-12, abs_tol=1e-9)
    assert tag.encoding is not None
    rough = digits * max(abs(value) for value in (*bounds(tag), tag.encoding.offset))
    return abs(one - other) <= (rough if tag.kind is ValueKind.FLOAT else max(rough, 1))


@pytest.mark.parametrize("target, digits", [("c", 0.0), ("iec-st", 1e-6)])
def test_a_program_reads_what_the_node_sends(target: str, digits: float, tmp_path: Path) -> None:
    bus = Bus()
    binary = program(tmp_path, bus.model, target)
    tags = tags_of(bus.model.outputs)
    draw = random.Random(1)
    for _ in range(ROUNDS):
        bus.show({tag.number: drawn(tag, draw) for tag in tags})
        shown = run(binary, "read", text=bus.octets())
        for tag, text in zip(tags, shown, strict=False):
            meant = bus.means(tag, bus.cell.image.values[tag.number - 1])
            assert is_same(number_of(text, tag), meant, tag, digits), tag.notation
        if target == "c":
            assert shown[len(tags) + 1] == str(bus.model.fingerprint)


@pytest.mark.parametrize("target, digits", [("c", 0.0), ("iec-st", 1e-6)])
def test_a_node_takes_what_a_program_sends(target: str, digits: float, tmp_path: Path) -> None:
    bus = Bus()
    binary = program(tmp_path, bus.model, target)
    tags = tags_of(bus.model.inputs)
    draw = random.Random(2)
    for _ in range(ROUNDS):
        wished = [text_of(drawn(tag, draw), tag) for tag in tags]
        bus.send(run(binary, text=" ".join(wished)))
        for tag, text in zip(tags, wished, strict=True):
            meant = bus.means(tag, number_of(text, tag))
            value = bus.cell.image.values[tag.number - 1]
            assert is_same(value, meant, tag, digits), (tag.notation, text)


def test_a_wrong_place_is_noticed(tmp_path: Path) -> None:
    """What the other tests compare would tell two bytes apart."""
    bus = Bus()
    tags = tags_of(bus.model.outputs)
    wrong = next(tag for tag in tags if tag.encoding is not None and tag.encoding.type == "int16")
    families = tuple(
        replace(family, tags=(replace(wrong, start=wrong.start - 8 if wrong.byte else 8),))
        if family.tags[0] is wrong
        else family
        for family in bus.model.outputs
    )
    binary = program(tmp_path, replace(bus.model, outputs=families))
    bus.show({tag.number: drawn(tag, random.Random(7)) for tag in tags})
    shown = run(binary, "read", text=bus.octets())
    differing = [
        tag.name
        for tag, text in zip(tags, shown, strict=False)
        if not is_same(number_of(text, tag), bus.means(tag, bus.cell.image.values[tag.number - 1]), tag, 0)
    ]
    assert differing == [wrong.name]

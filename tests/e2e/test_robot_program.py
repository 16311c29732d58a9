"""The generated robot program against a PLC, through simulator and gateway: the self test of both, and a fault in it.

The program is run by our interpreter of URScript, with the simulator's registers behind its functions; the PLC has its
values from the table in the generated file, and the addresses from `gatewayd show`.
"""

from __future__ import annotations

import csv
import io
import re
import struct
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Thread
from types import SimpleNamespace
from typing import Any

import pytest

from gatewayd.core.definition import Direction
from gatewayd.links.modbus_server.plc.build import model_of
from gatewayd.links.modbus_server.plc.model import PlcModel
from gatewayd.links.modbus_server.plc.st.main import blocks
from gatewayd.links.modbus_server.plc.targets.iec_st import DIALECT
from gatewayd.plc.tags import PlcWishes
from tests.e2e.plant import Plant
from tests.e2e.plc import PLC, Plc
from tests.e2e.processes import Simulator, wait_for
from tests.links.modbus_server.plc import test_running as compiled
from tests.links.modbus_server.plc.simulation import assign, instance, structure, value_in
from tests.links.robot.urscript.language import load
from tests.plc_golden import plan_from

VARIABLES = f"""\
writers: {{plc: {{modbus: {PLC}}}}}
variables:
  order:      {{robot: input_bit_register_0,     modbus: 0.0}}
  order_seen: {{robot: output_bit_register_0,    modbus: 100.0}}
  lamp:       {{robot: input_bit_register_33,    modbus: 0.1}}
  count:      {{robot: input_int_register_0,     modbus: 10}}
  recipe:     {{robot: input_int_register_4..5,  modbus: {{holding: 12, type: uint16}}}}
  force:      {{robot: input_double_register_7,  modbus: {{holding: 20, type: int16, scale: 0.1}}, limits: [0, 150]}}
  ready:      {{robot: output_bit_register_40,   modbus: 100.1}}
  made:       {{robot: output_int_register_23,   modbus: {{holding: 110, order: CDAB}}}}
  warm:       {{robot: output_double_register_2, modbus: {{holding: 120, type: float32}}}}
"""
CODES = {"uint16": ">H", "int16": ">h", "int32": ">i", "float32": ">f", "float64": ">d"}
TABLE = re.compile(r"#\s+(\d+)\s+(\S+)\s+(\S+)\s+(\S+), (to|from) the robot")


@dataclass(frozen=True)
class Line:
    """A variable of the table in the generated file."""

    number: int
    low: float
    high: float
    name: str
    to_robot: bool

    def value(self, step: int) -> float:
        return self.high if self.number >> step & 1 else self.low


def command(*arguments: str | Path) -> str:
    """`gatewayd ...` as a user runs it."""
    line = [sys.executable, "-m", "gatewayd", *map(str, arguments)]
    return subprocess.run(line, check=True, capture_output=True, text=True).stdout


def number(text: str) -> float:
    return float(text == "True") if text in ("True", "False") else float(text)


class Controller:
    """The functions of a robot program, on a simulator; `step` is one control cycle."""

    def __init__(self, simulator: Simulator) -> None:
        self.simulator = simulator
        self.said: list[str] = []

    def functions(self) -> dict[str, Callable[..., Any]]:
        found: dict[str, Callable[..., Any]] = {
            "sync": self.step,
            "textmsg": lambda *texts: self.said.append("".join(map(str, texts))),
        }
        for side in ("input", "output"):
            found[f"read_{side}_boolean_register"] = lambda index, side=side: self._bit(side, index)
            found[f"read_{side}_integer_register"] = lambda index, side=side: self.simulator.integer(
                f"{side}_int_register_{index}"
            )
            found[f"read_{side}_float_register"] = lambda index, side=side: self.simulator.number(
                f"{side}_double_register_{index}"
            )
        found["write_output_boolean_register"] = self._set_bit
        found["write_output_integer_register"] = lambda index, value: self._set(
            f"output_int_register_{index}", value
        )
        found["write_output_float_register"] = lambda index, value: self._set(
            f"output_double_register_{index}", value
        )
        return found

    def step(self) -> None:
        before = self.simulator.number("timestamp")
        wait_for(lambda: self.simulator.number("timestamp") > before, "the next control cycle")

    def _word(self, side: str, index: int) -> str:
        return f"{side}_bit_registers{'0_to_31' if index < 32 else '32_to_63'}"

    def _bit(self, side: str, index: int) -> bool:
        return bool(self.simulator.integer(self._word(side, index)) >> index % 32 & 1)

    def _set_bit(self, index: int, value: bool) -> None:
        word = self._word("output", index)
        others = self.simulator.integer(word) & ~(1 << index % 32)
        self._set(word, others | value << index % 32)

    def _set(self, field: str, value: float) -> None:
        self.simulator.do(f"set {field} {value}")


class Counterpart:
    """The PLC's part of the self test."""

    def __init__(self, plc: Plc, mapping: Path, script: str, exchanged: Mapping[str, str]) -> None:
        self.plc = plc
        rows = csv.DictReader(io.StringIO(command("show", "--format", "csv", mapping)))
        self.places = {row["name"]: row for row in rows}
        self.places |= {name: self.places[other] for name, other in exchanged.items()}
        self.table = [
            Line(int(found[1]), number(found[2]), number(found[3]), found[4], found[5] == "to")
            for found in TABLE.finditer(script)
        ]
        self.wrong: list[str] = []

    def run(self, rounds: int) -> None:
        for step in range(rounds):
            inputs = [line for line in self.table if line.to_robot]
            bits = sum(int(line.value(step)) << 1 for line in inputs if line.name == "lamp")
            toggle = self.plc.read(0)[0] & 1
            assert not self.plc.write(0, [bits | toggle])
            for line in inputs:
                if line.name != "lamp":
                    place = self.places[line.name]
                    assert not self.plc.write(int(place["address"]), self._words(place, line.value(step)))
            assert not self.plc.write(0, [bits | (1 - toggle)])
            wait_for(lambda: self.plc.read(100)[0] & 1 == self.plc.read(0)[0] & 1, "the acknowledgement")
            self.wrong += [
                line.name
                for line in self.table
                if not line.to_robot and self._read(self.places[line.name]) != line.value(step)
            ]

    def _words(self, place: Mapping[str, str], value: float) -> list[int]:
        code = CODES[place["type"]]
        raw = value if code in (">f", ">d") else round(value / float(place["scale"]))
        packed = struct.pack(code, raw)
        words = [int.from_bytes(packed[at : at + 2]) for at in range(0, len(packed), 2)]
        return words[::-1] if place["order"] == "CDAB" else words

    def _read(self, place: Mapping[str, str]) -> float:
        words = self.plc.read(int(place["address"]), int(place["words"]))
        if place["type"] == "bit":
            return float(words[0] >> int(place["bit"]) & 1)
        words = words[::-1] if place["order"] == "CDAB" else words
        raw = struct.unpack(CODES[place["type"]], b"".join(word.to_bytes(2) for word in words))[0]
        return float(raw * float(place["scale"]))


def run(plant: Plant, exchanged: Mapping[str, str]) -> tuple[int, list[str], Counterpart]:
    """Both halves; what the program returned and said, and the PLC."""
    simulator = plant.simulator("--control", "stdin")
    mapping = plant.mapping(VARIABLES, simulator.port)
    script = command("export", "urscript", mapping, "--handshake", "order:order_seen")
    plant.daemon(mapping)
    counterpart = Counterpart(plant.ready_plc(), mapping, script, exchanged)
    controller = Controller(simulator)
    program = load(script, **controller.functions())
    returned: list[int] = []
    robot = Thread(target=lambda: returned.append(program.call("gw_self_test")), daemon=True)
    robot.start()
    rounds = max(line.number for line in counterpart.table).bit_length() + 1
    counterpart.run(rounds)
    robot.join(30)
    assert returned, "the program did not end"
    return returned[0], controller.said, counterpart


def test_program_and_plc_find_every_register_right(plant: Plant) -> None:
    wrong, said, counterpart = run(plant, {})
    assert {line.name for line in counterpart.table} == {
        "lamp", "count", "recipe[0]", "recipe[1]", "force", "ready", "made", "warm",
    }  # fmt: skip
    assert (wrong, counterpart.wrong) == (0, [])
    assert said == ["gw self test, wrong values: 0"]


def test_program_and_plc_name_what_is_exchanged(plant: Plant) -> None:
    wrong, said, counterpart = run(
        plant, {"recipe[0]": "recipe[1]", "recipe[1]": "recipe[0]", "made": "warm"}
    )
    assert wrong > 0
    assert {line for line in said if "wrong: " in line} == {
        f"gw self test, wrong: recipe[{index}]" for index in range(2)
    }
    assert "made" in counterpart.wrong


class GeneratedPlc:
    """The lines of `iec-st`: the block stepped through, with conversions compiled from the same lines, over Modbus."""

    def __init__(self, plc: Plc, model: PlcModel, folder: Path) -> None:
        self.plc, self.model = plc, model
        self.binary = compiled.program(folder, replace(model, self_test=None), "iec-st")
        self.inputs, self.outputs = structure(model.inputs), structure(model.outputs)
        self.status = SimpleNamespace(trusted=True, values_fresh=True, robot_writable=True, refusals=0)
        (unit,) = (unit for unit in blocks(model, DIALECT) if unit.name == "GW_SelfTest")
        data = {"status": self.status, "inputs": self.inputs, "outputs": self.outputs}
        self.block, self._call = instance(unit, **data, time_out=10_000, settle=50)

    def run(self) -> None:
        self.block.run = True
        wait_for(self._is_done, "the end of the self test")

    def _is_done(self) -> bool:
        """One round of requests, and the block."""
        words = [word for poll in self.model.reads for word in self.plc.read(poll.address, poll.count)]
        shown = compiled.run(self.binary, "read", text=" ".join(f"{word:x}" for word in words))
        for tag, text in zip(compiled.tags_of(self.model, Direction.OUTPUT), shown, strict=True):
            assign(self.outputs, tag, compiled.number_of(text, tag))
        self._call()
        texts = (
            compiled.text_of(value_in(self.inputs, tag), tag)
            for tag in compiled.tags_of(self.model, Direction.INPUT)
        )
        packed = compiled.run(self.binary, text=" ".join(texts))
        words = [int(word, 16) for word in packed]
        for poll in self.model.writes:
            mine, words = words[: poll.count], words[poll.count :]
            assert not self.plc.write(poll.address, mine)
        self.block.written += 1
        return bool(self.block.done)


def both(plant: Plant, folder: Path, variables_of_plc: str) -> tuple[int, Any]:
    """Both generated halves, the PLC's from a mapping that may differ; what the program returned, and the block."""
    simulator = plant.simulator("--control", "stdin")
    mapping = plant.mapping(VARIABLES, simulator.port)
    script = command("export", "urscript", mapping, "--handshake", "order:order_seen")
    plant.daemon(mapping)
    other = folder / "plc.yaml"
    other.write_text(mapping.read_text().replace(VARIABLES, variables_of_plc))
    model = model_of(plan_from(other), PlcWishes(handshake="order:order_seen"))
    plc = GeneratedPlc(plant.ready_plc(), model, folder)
    returned: list[int] = []
    program = load(script, **Controller(simulator).functions())
    robot = Thread(target=lambda: returned.append(program.call("gw_self_test")), daemon=True)
    robot.start()
    plc.run()
    robot.join(30)
    assert returned, "the program did not end"
    return returned[0], plc.block


@pytest.mark.skipif(compiled.COMPILER is None, reason="no C compiler")
def test_the_generated_plc_and_the_generated_program_agree(plant: Plant, tmp_path: Path) -> None:
    wrong, block = both(plant, tmp_path, VARIABLES)
    assert (wrong, block.passed, block.error, block.first_name) == (0, True, False, "")


@pytest.mark.skipif(compiled.COMPILER is None, reason="no C compiler")
def test_a_wrong_word_order_in_the_generated_plc_is_named(plant: Plant, tmp_path: Path) -> None:
    wrong, block = both(plant, tmp_path, VARIABLES.replace(", order: CDAB", ""))
    assert (wrong, block.passed, block.error, block.reason, block.first_name) == (0, False, True, 4, "made")

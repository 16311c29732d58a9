"""The watch of the status block in structured text, stepped through with the words of a real one."""

from __future__ import annotations

import shutil
import struct
import subprocess
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.refusal import Reason
from gatewayd.core.requester import Requester, new_connection
from gatewayd.core.status import StatusBlock
from gatewayd.core.status_layout import BASE
from gatewayd.links.modbus_server.plc.build import model_of
from gatewayd.links.modbus_server.plc.model import PlcModel
from gatewayd.links.modbus_server.plc.st.watch import watch
from gatewayd.links.modbus_server.plc.targets.iec_st import DIALECT
from gatewayd.links.registry import status_fields
from gatewayd.mapping.plan import Plan
from gatewayd.plc.st.types import meanings
from gatewayd.plc.tags import PlcWishes
from tests.links.modbus_server.plc.cells import plan_of
from tests.links.modbus_server.plc.logix_translation import SHOWN
from tests.links.modbus_server.plc.logix_translation import watching as watching_source
from tests.links.modbus_server.plc.simulation import CYCLE, instance

COMPILER = shutil.which("cc")
SECOND = 1000 // CYCLE
NAMES = {f"GW_{kind}_{name}": name for kind, named in meanings().items() for name, _text in named}
FUNCTIONS: dict[str, object] = {
    **dict.fromkeys(("WORD_TO_INT", "WORD_TO_UINT", "DWORD_TO_UDINT"), lambda number: number),
    "GW_Double": lambda high, low: high << 16 | low,
    "SHR": lambda number, places: number >> places,
}
LINES = (
    "part: {robot: input_int_register_0, modbus: {holding: 1, type: uint16}, owner: plc, limits: [0, 9]}",
    "q: {robot: actual_q, modbus: {holding: 10, type: float32}, on_stale: clear}",
    "many: {robot: 'output_bit_register_0..31', modbus: 100.0}",
)


class Plc:
    """A gateway's cell, and a PLC that reads its status block before each cycle."""

    def __init__(self, plan: Plan) -> None:
        self.now = 100.0
        self.silent = False
        """The robot sends nothing."""
        self.cell = Cell(plan.cell)
        self.cell.robot_connected(self.now)
        self.cell.adopt({0: 0}, self.now)
        self.package()
        self.model: PlcModel = model_of(plan, PlcWishes(writer="plc"))
        self.block = StatusBlock(self.cell, status_fields())
        self.image = SimpleNamespace(**{poll.name: [0] * poll.count for poll in self.model.polls})
        count = len(self.model.variables) + 1
        self.status = SimpleNamespace(
            alive=False, good=[False] * count, quality=[""] * count, owner=[0] * count
        )
        unit = watch(self.model, DIALECT)
        self.seen: list[list[int]] = []
        self.told: list[str] = []
        """What a PLC has read in each cycle, as `logix_translation.watching` takes it."""
        self.own, self.call = instance(
            unit, {**NAMES, **FUNCTIONS}, image=self.image, status=self.status, patience=1000
        )

    def package(self) -> None:
        self.cell.package_arrived(self.now, self.now)
        self.cell.outputs_written(self.now)

    def run(self, cycles: int = 1, *, reads: bool = True) -> Any:
        for _cycle in range(cycles):
            self.now += 0.2 if reads else 0.0
            if reads:
                if not self.silent:
                    self.package()
                self.cell.tick(self.now)
                self.cell.health.heartbeat += 1
                for poll in self.model.status:
                    words = self.block.read(poll.address - BASE, poll.count, self.now)
                    setattr(self.image, poll.name, list(struct.unpack(f">{poll.count}H", words)))
            read = [word for poll in self.model.status for word in getattr(self.image, poll.name)]
            self.told.append(" ".join(["1", *(f"{word:x}" for word in read)]) if reads else "0")
            self.call()
            self.seen.append(self._row())
        return self.status

    def _row(self) -> list[int]:
        """As numbers, in the order of the translation."""
        kinds = {"robot_state": "robot", "program_state": "program", "refusal": "refusal"}
        row = [_number(kinds.get(name, ""), getattr(self.status, name)) for name in SHOWN]
        qualities = [_number("quality", name) for name in self.status.quality[1:]]
        return [*row, *map(int, self.status.good[1:]), *qualities, *self.status.owner[1:]]


def _number(kind: str, value: Any) -> int:
    """Of a name its number, of a DWORD that of a DINT."""
    if kind:
        return [name for name, _text in meanings()[kind]].index(value)
    return int(value) - (1 << 32) if int(value) >> 31 else int(value)


def watching() -> Plc:
    return Plc(plan_of(*LINES))


def test_a_gateway_that_lives_is_trusted_and_one_that_is_silent_is_not() -> None:
    plc = watching()
    status = plc.run(6)
    assert (status.alive, status.right_mapping, status.trusted) == (True, True, True)
    assert status.fingerprint == plc.model.fingerprint
    status = plc.run(SECOND + 2, reads=False)
    assert (status.alive, status.trusted, status.robot_age) == (False, False, 4294967295)
    assert (status.robot_state, set(status.quality[1:]), any(status.good)) == ("unknown", {"unknown"}, False)


def test_flags_qualities_and_owners_are_those_of_the_cell() -> None:
    plc = watching()
    plc.run(6)
    writer = Requester(0, "127.0.0.1", new_connection())
    assert plc.cell.write(writer, [Change(0, 5)], plc.now) is None
    status = plc.run(2)
    assert (status.values_fresh, status.robot_writable, status.lock_owned) == (True, True, True)
    assert status.robot_state == "fresh"
    assert (status.owner[1], set(status.owner[2:])) == (1, {0})
    expected = [plc.cell.image.quality[index] for index in range(len(plc.model.variables))]
    assert status.quality[1:] == [quality.name.lower() for quality in expected]
    assert status.good[1:] == [quality.name == "GOOD" for quality in expected]


def test_a_refusal_is_told_for_one_cycle_with_its_reason() -> None:
    plc = watching()
    plc.run(6)
    plc.cell.write(Requester(0, "127.0.0.1", new_connection()), [Change(0, 99)], plc.now)
    status = plc.run()
    assert (status.refused_now, status.refusal) == (True, Reason.OUT_OF_LIMITS.name.lower())
    assert (status.refusal_variable, status.refusal_writer) == (1, 1)
    assert not plc.run().refused_now


def test_another_mapping_is_noticed() -> None:
    plc = watching()
    other = plan_of(*LINES[:2])
    plc.cell = Cell(other.cell)
    plc.cell.robot_connected(plc.now)
    plc.block = StatusBlock(plc.cell, status_fields())
    status = plc.run(6)
    assert (status.alive, status.wrong_mapping, status.trusted) == (True, True, False)


@pytest.mark.skipif(COMPILER is None, reason="no C compiler")
def test_logix_says_the_same(tmp_path: Path) -> None:
    """Cycle by cycle, over a life with a write, a refusal, silence, the way back, and a robot that is lost."""
    plc = watching()
    plc.run(4)
    writer = Requester(0, "127.0.0.1", new_connection())
    plc.cell.write(writer, [Change(0, 5)], plc.now)
    plc.run(2)
    plc.cell.write(writer, [Change(0, 99)], plc.now)
    plc.run(3)
    plc.run(SECOND + 3, reads=False)
    plc.run(3)
    plc.cell.freshness.stale_after = 0.1
    plc.silent = True
    plc.run(2)
    plc.cell.robot_lost("gone", plc.now)
    plc.run(2)
    (tmp_path / "main.c").write_text(watching_source(plc.model))
    command = [COMPILER or "", "-std=gnu99", "-Wall", "-Werror", "main.c", "-o", "plc", "-lm"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    shown = subprocess.run(
        [tmp_path / "plc"], input="\n".join(plc.told), capture_output=True, text=True, check=True
    ).stdout
    rows = [list(map(int, line.split())) for line in shown.splitlines()]
    for cycle, (row, seen) in enumerate(zip(rows, plc.seen, strict=True)):
        assert row == seen, cycle

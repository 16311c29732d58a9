"""The watch of the status words, stepped through: alive, the right mapping, names of numbers, and what is not known."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from gatewayd.core.freshness import Source
from gatewayd.core.image import Quality
from gatewayd.core.refusal import Reason
from gatewayd.links.canopen_node.plc.content import Bytes, Content, Objects
from gatewayd.links.canopen_node.plc.model import PdoImage, PdoModel, PdoWord
from gatewayd.links.canopen_node.plc.watch import watch
from gatewayd.plc.st.cast import POINTER
from gatewayd.plc.st.dialect import Dialect
from gatewayd.plc.st.types import meanings
from tests.links.canopen_node.plc.cells import model
from tests.links.modbus_server.plc.simulation import CYCLE, instance
from tests.plc_golden import canopen_model

SECOND = 1000 // CYCLE
NAMES = {f"GW_{kind}_{name}": name for kind, named in meanings().items() for name, _text in named}
FUNCTIONS: dict[str, object] = {
    **dict.fromkeys(
        ("UINT_TO_WORD", "UDINT_TO_DWORD", "WORD_TO_INT", "WORD_TO_UINT", "DWORD_TO_UDINT"),
        lambda number: number,
    ),
    "GW_Word": lambda low, high: high << 8 | low,
    "GW_Double": lambda high, low: high << 16 | low,
}


class Master:
    """A master with the block, which hands over bytes or objects."""

    def __init__(self, found: PdoModel, content: Content) -> None:
        self.words: dict[str, PdoWord] = {
            word.object_name: word for pdo in found.from_node for word in pdo.words
        }
        self.content = content
        self.beats = 0
        self.from_node = SimpleNamespace(**{pdo.name: self._empty(pdo) for pdo in found.from_node})
        count = len(found.variables) + 1
        self.status = SimpleNamespace(alive=False, quality=[""] * count, good=[False] * count)
        self.block, self._call = instance(
            watch(found, Dialect(POINTER), content),
            {**NAMES, **FUNCTIONS},
            from_node=self.from_node,
            status=self.status,
            operational=True,
            patience=1000,
        )

    def _empty(self, pdo: PdoImage) -> list[int] | SimpleNamespace:
        if isinstance(self.content, Bytes):
            return [0] * pdo.size
        return SimpleNamespace(**{word.object_name: 0 for word in pdo.words})

    def set(self, **numbers: int) -> None:
        """What the node sends."""
        for name, number in numbers.items():
            word = self.words[name]
            place = getattr(self.from_node, word.pdo)
            if isinstance(place, list):
                size = 2 * word.words
                place[word.byte : word.byte + size] = number.to_bytes(size, "little")
            else:
                setattr(place, name, number)

    def run(self, cycles: int = 1, *, beating: bool = True) -> SimpleNamespace:
        for _ in range(cycles):
            if beating:
                self.beats += 1
                self.set(status_heartbeat=self.beats)
            self._call()
        return self.status

    def once(self) -> SimpleNamespace:
        self._call()
        return self.status


@pytest.fixture(params=[Bytes(), Objects()], ids=["bytes", "objects"])
def master(request: pytest.FixtureRequest) -> Master:
    found = canopen_model()
    master = Master(found, request.param)
    master.set(status_fingerprint=found.fingerprint)
    return master


def test_a_heartbeat_that_moves_is_alive_and_one_that_stands_is_not(master: Master) -> None:
    assert not master.run().alive
    assert master.run().trusted
    assert master.run(SECOND, beating=False).alive
    assert not master.run(2, beating=False).alive
    assert master.run().trusted


def test_a_node_that_is_lost_is_not_alive_at_once(master: Master) -> None:
    assert master.run(3).alive
    master.block.operational = False
    assert not master.run().trusted


def test_another_mapping_is_not_trusted(master: Master) -> None:
    master.set(status_fingerprint=1)
    status = master.run(3)
    assert (status.alive, status.wrong_mapping, status.trusted) == (True, True, False)


def test_numbers_have_names(master: Master) -> None:
    master.set(
        status_flags=0b1000001,
        status_robot_state=Source.FRESH,
        status_program=3,
        status_refusal_reason=Reason.HELD,
        status_refusal_variable=5,
        status_robot_age=7,
        quality_11=Quality.GOOD,
        quality_7=Quality.STALE,
    )
    status = master.run(3)
    assert (status.values_fresh, status.robot_writable, status.watchdog_fed) == (True, False, True)
    assert (status.robot_state, status.program_state) == ("fresh", "playing")
    assert (status.refusal, status.refusal_variable, status.robot_age) == ("held", 5, 7)
    assert (status.quality[11], status.quality[7], status.quality[1]) == ("good", "stale", "unknown")
    assert (status.good[11], status.good[7], status.good[1]) == (True, False, False)
    master.set(status_robot_state=99)
    assert master.run().robot_state == "unknown"


def test_a_refusal_is_told_for_one_cycle(master: Master) -> None:
    master.set(status_refused=4)
    assert not master.run(3).refused_now
    master.set(status_refused=5)
    assert master.run().refused_now
    assert not master.run().refused_now


def test_what_is_old_is_not_known(master: Master) -> None:
    master.set(status_robot_state=Source.FRESH, quality_11=Quality.GOOD)
    master.run(3)
    status = master.run(SECOND + 2, beating=False)
    assert (status.robot_state, status.robot_age) == ("unknown", 4294967295)
    assert (status.quality[11], status.good[11]) == ("unknown", False)


def test_without_status_words_the_master_decides() -> None:
    master = Master(model("ready: {robot: output_bit_register_0, canopen: auto}"), Objects())
    assert master.once().trusted
    master.block.operational = False
    assert not master.once().trusted

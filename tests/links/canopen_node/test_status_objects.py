"""The status block as objects: the same numbers as on Modbus, and the same requests."""

from __future__ import annotations

from functools import partial

import pytest

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import Abort, AbortCode, Access, Dictionary, Pdo
from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition, Direction, Lock, ValueKind, Variable, Writer
from gatewayd.core.refusal import Reason
from gatewayd.core.requester import Requester
from gatewayd.core.status import StatusBlock
from gatewayd.core.status_layout import LENGTH, RELEASE_ALL, TABLES
from gatewayd.links.canopen_node.status_objects import StatusObjects, status_word
from gatewayd.links.canopen_node.status_words import HEADER, TABLE_INDICES
from gatewayd.links.registry import status_fields

LINE, HMI = range(2)
COUNT = 300
"""More variables than an array has entries."""


_NOBODY = (partial(Requester, None), partial(Requester, None))


def _definition(count: int = COUNT, writers: tuple[str, ...] = ("line", "hmi")) -> CellDefinition:
    variables = tuple(
        Variable(
            index + 1,
            f"v{index}",
            Direction.INPUT,
            ValueKind.INT,
            f"input_{index}",
            low=-9,
            high=9,
            lock=index,
        )
        for index in range(count)
    )
    return CellDefinition(
        name="big",
        fingerprint=0xC0FFEE42,
        variables=variables,
        locks=tuple(
            Lock(one.name, (index,), (LINE, HMI) if index else (HMI,), lease=2.0)
            for index, one in enumerate(variables)
        ),
        writers=tuple(map(Writer, writers)),
        stale_after=0.1,
    )


class Node:
    """A cell with its robot up, and its status block as objects, at a time that can be set."""

    def __init__(self, writer: int | None = LINE) -> None:
        self.now = 1.0
        self.cell = Cell(_definition())
        self.cell.robot_connected(0.0)
        self.cell.adopt(dict.fromkeys(range(COUNT), 0), 0.0)
        self.heard = True
        self.asked = 0
        """Requests of a lock."""
        self._writer = writer
        self.dictionary = Dictionary(
            StatusObjects(
                self.cell,
                lambda: self.now,
                lambda: Requester(writer, trusted=self.heard),
                self._asking,
            ).objects()
        )
        self.subindices = {
            entry.name: entry.subindex
            for one in self.dictionary
            for entry in one.entries
            if one.index == HEADER
        }

    def _asking(self) -> Requester:
        self.asked += 1
        return Requester(self._writer, trusted=self.heard)

    def field(self, name: str) -> int:
        return int.from_bytes(self.dictionary.read(HEADER, self.subindices[name]), "little")

    def put(self, name: str, value: int) -> AbortCode | None:
        try:
            self.dictionary.write(HEADER, self.subindices[name], value.to_bytes(2, "little"))
        except Abort as abort:
            return abort.code
        return None

    def entry(self, table: str, number: int) -> int:
        further, subindex = divmod(number - 1, 254)
        return int.from_bytes(self.dictionary.read(TABLE_INDICES[table] + further, subindex + 1), "little")


@pytest.fixture
def node() -> Node:
    return Node()


def test_header_has_every_field_by_its_name() -> None:
    header = next(iter(Node().dictionary))
    assert header.index == 0x5F00
    assert [(one.subindex, one.name) for one in header.entries[1:]] == [
        (number, field.name) for number, field in enumerate(status_fields(), 1)
    ]
    assert {one.type for one in header.entries[1:]} == {CanType.UNSIGNED16, CanType.UNSIGNED32}
    writable = [one.name for one in header.entries if one.access is Access.RW]
    assert writable == ["request", "release"]
    unmapped = [one.name for one in header.entries[1:] if one.pdo is Pdo.NONE]
    assert unmapped == ["request", "release"]


def test_indices_are_fixed_and_apart() -> None:
    """The largest cell has five indices to a table of variables."""
    assert set(TABLE_INDICES) == {table.name for table in TABLES}
    assert TABLE_INDICES == {
        "good": 0x5F01,
        "writers_alive": 0x5F02,
        "owner": 0x5F10,
        "lease": 0x5F20,
        "age": 0x5F30,
        "quality": 0x5F40,
    }
    largest = Cell(_definition(1024, tuple(f"w{number}" for number in range(32))))
    indices = [one.index for one in StatusObjects(largest, float, *_NOBODY).objects()]
    assert len(indices) == len(set(indices)) == 3 + 4 * 5
    assert all(len(one.entries) <= 255 for one in StatusObjects(largest, float, *_NOBODY).objects())


def test_every_word_is_that_of_the_block(node: Node) -> None:
    """Whatever the state of the cell, both buses show the same."""
    cell = node.cell
    cell.writer_connected(Requester(LINE), 0.5)
    for index in (1, 20, 299):
        assert cell.write(Requester(LINE), [Change(index, 3)], 0.5 + index / 1000) is None
    assert cell.write(Requester(HMI), [Change(20, 4)], 0.9) is not None
    cell.set_availability([7], False, "in use", 0.9)
    block = StatusBlock(cell, status_fields()).read(0, LENGTH, node.now)

    def words(offset: int, count: int) -> int:
        return int.from_bytes(block[2 * offset : 2 * (offset + count)], "big")

    assert {field.name: node.field(field.name) for field in status_fields()} == {
        field.name: words(field.offset, field.words) for field in status_fields()
    }
    counts = {"good": 19, "writers_alive": 2}
    for table in TABLES:
        numbers = range(1, counts.get(table.name, COUNT) + 1)
        assert [node.entry(table.name, number) for number in numbers] == [
            words(table.offset + number - 1, 1) for number in numbers
        ]
    assert node.field("fingerprint") == 0xC0FFEE42
    assert node.entry("owner", 300) == LINE + 1


def test_entries_are_named_after_variables_and_writers(node: Node) -> None:
    def name(index: int, subindex: int) -> str:
        return node.dictionary.entry(index, subindex).name

    assert name(TABLE_INDICES["owner"], 1) == "owner v0"
    assert name(TABLE_INDICES["age"] + 1, 1) == "age v254"
    assert name(TABLE_INDICES["good"], 2) == "good v16..v31"
    assert name(TABLE_INDICES["writers_alive"], 2) == "writers_alive hmi"


def test_a_cell_without_writers_has_no_table_of_them() -> None:
    bare = Cell(CellDefinition("bare", 1, (), (), (), 0.1))
    assert [one.index for one in StatusObjects(bare, float, *_NOBODY).objects()] == [HEADER]


def test_tables_are_read_only(node: Node) -> None:
    with pytest.raises(Abort) as error:
        node.dictionary.write(TABLE_INDICES["owner"], 1, bytes(2))
    assert error.value.code is AbortCode.READ_ONLY
    assert node.put("layout", 1) is AbortCode.READ_ONLY


def test_request_and_release_take_variable_numbers(node: Node) -> None:
    assert node.put("request", 2) is None
    assert (node.entry("owner", 2), node.entry("lease", 2)) == (LINE + 1, 2000)
    assert node.field("request") == 0
    node.now = 1.5
    assert node.entry("lease", 2) == 1500
    assert node.put("release", 2) is None
    assert node.entry("owner", 2) == 0


def test_release_all(node: Node) -> None:
    assert node.put("request", 2) is None
    assert node.put("request", 3) is None
    assert node.put("release", RELEASE_ALL) is None
    assert node.cell.ownership.held_by(LINE) == []


def test_0_requests_nothing(node: Node) -> None:
    assert node.put("request", 0) is None
    assert node.cell.health.writes_refused == 0


def test_refused_requests_are_aborted(node: Node) -> None:
    node.cell.request(Requester(HMI), 1, node.now)
    assert node.put("request", 2) is AbortCode.LOCAL_CONTROL
    assert node.put("release", 2) is AbortCode.LOCAL_CONTROL
    assert node.put("request", 1) is AbortCode.READ_ONLY
    assert node.put("request", COUNT + 1) is AbortCode.INVALID_VALUE
    assert node.cell.health.writes_refused == 4


def test_an_undeclared_sdo_client_takes_no_lock() -> None:
    node = Node(writer=None)
    assert node.put("request", 2) is AbortCode.READ_ONLY
    assert node.cell.health.writes_refused == 1


def test_an_sdo_client_that_is_not_heard_moves_no_lock_and_reads_on(node: Node) -> None:
    assert node.put("request", 2) is None
    node.heard = False
    assert node.put("request", 3) is AbortCode.DEVICE_STATE
    assert node.put("release", 2) is AbortCode.DEVICE_STATE
    assert node.put("release", RELEASE_ALL) is AbortCode.DEVICE_STATE
    assert (node.entry("owner", 2), node.entry("owner", 3)) == (LINE + 1, 0)
    assert node.field("refusal_reason") == Reason.HEARTBEAT_LOST


def test_a_release_and_a_read_are_no_request(node: Node) -> None:
    node.put("release", 2)
    node.put("request", 0)
    node.field("heartbeat")
    assert node.asked == 0
    node.put("request", 2)
    assert node.asked == 1


def test_what_a_tpdo_may_carry_is_where_the_dictionary_has_it(node: Node) -> None:
    """And holds the same bytes."""
    block = StatusBlock(node.cell, status_fields())
    for one in node.dictionary:
        for entry in one.entries:
            word = status_word(one.index, entry.subindex)
            assert (word is not None) == (entry.pdo is Pdo.TRANSMIT)
            if word is not None:
                assert word.type is entry.type
                assert word.offset is not None
                words = word.type.bits // 16
                assert block.read(word.offset, words, node.now)[::-1] == entry.read()


@pytest.mark.parametrize(
    "index, subindex", [(0x5EFF, 1), (0x5F00, 0), (0x5F00, 255), (0x5F03, 1), (0x5F15, 1), (0x5F40, 0)]
)
def test_nothing_of_the_status_block_lies_elsewhere(index: int, subindex: int) -> None:
    assert status_word(index, subindex) is None

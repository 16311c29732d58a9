from __future__ import annotations

from pathlib import Path

import pytest

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import (
    Abort,
    AbortCode,
    Access,
    Entry,
    Object,
    Pdo,
    Pending,
    array,
    record,
    variable,
)
from gatewayd.canopen.nmt import NmtCommand
from gatewayd.links.canopen_node.storage import SAVES, SAVES_PER_SECOND, Parameters, layout_of
from gatewayd.links.canopen_node.store import JsonStore, Kept, LssSettings, Saved, Store, StoreError
from tests.links.canopen_node.wire import Client

U32 = CanType.UNSIGNED32


def _objects(name: str = "force") -> list[Object]:
    period = Entry(0, "Producer heartbeat time", CanType.UNSIGNED16, Access.RW, b"\xe8\3", stored=True)
    emcy = Entry(0, "COB-ID EMCY", U32, Access.RW, U32.pack(0x85), plus_node=True, stored=True)
    cob_id = Entry(1, "COB-ID", U32, Access.RW, U32.pack(0x185), plus_node=True, stored=True)
    value = Entry(1, name, U32, Access.RW, bytes(4), stored=True)
    loose = Entry(0, "Synchronous window length", U32, Access.RW, bytes(4))
    return [
        variable(0x1007, loose),
        variable(0x1014, emcy),
        variable(0x1017, period),
        record(0x1800, "TPDO 1", (cob_id,)),
        record(0x2000, "Values", (value,)),
        record(0x6000, "Profile", (Entry(1, "x", U32, Access.RW, bytes(4), stored=True),)),
    ]


class KeptParameters:
    """A node's parameters on a store."""

    def __init__(self, store: Store, objects: list[Object] | None = None, node: int = 5) -> None:
        self.reports: list[str] = []
        self.failures: list[bool] = []
        self.ready = True
        self.now = 100.0
        self.ended = 0
        self.service = Parameters(
            store,
            node,
            ready=lambda: self.ready,
            report=self.reports.append,
            failed=self.failures.append,
            ended=self._end,
            clock=lambda: self.now,
        )
        self.client = Client([*(objects or _objects()), *self.service.objects()])
        self.service.bind(self.client.dictionary)
        self.service.apply(NmtCommand.RESET_NODE, self.service.node)

    def _end(self) -> None:
        self.ended += 1

    def signed(self, index: int, subindex: int, signature: bytes) -> Pending:
        pending = self.client.dictionary.write(index, subindex, signature)
        assert pending is not None
        return pending


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "press-3.json"


def test_cct_testing_other_01_capabilities_are_on_command() -> None:
    client = KeptParameters(Store()).client
    for index in (0x1010, 0x1011):
        assert [client.read(index, number) for number in range(5)] == [4, 1, 1, 1, 1]


@pytest.mark.parametrize("index, signature", [(0x1010, b"load"), (0x1010, b"evas"), (0x1011, b"save")])
def test_cct_testing_other_02_wrong_signature_is_refused(index: int, signature: bytes) -> None:
    with pytest.raises(Abort) as caught:
        KeptParameters(Store()).signed(index, 1, signature)
    assert caught.value.code is AbortCode.CANNOT_STORE


def test_cct_testing_other_03_saved_parameters_survive_a_restart(path: Path) -> None:
    first = KeptParameters(JsonStore(path))
    first.client.write(0x1017, 0, 50)
    first.client.write(0x2000, 1, 7)
    first.signed(0x1010, 1, b"save")
    second = KeptParameters(JsonStore(path))
    assert (second.client.read(0x1017), second.client.read(0x2000, 1)) == (50, 7)
    assert second.reports == []


def test_cct_testing_other_04_restored_defaults_come_with_the_next_reset(path: Path) -> None:
    kept = KeptParameters(JsonStore(path))
    kept.client.write(0x1017, 0, 50)
    kept.signed(0x1010, 1, b"save")
    kept.signed(0x1011, 1, b"load")
    assert kept.client.read(0x1017) == 50
    kept.service.apply(NmtCommand.RESET_COMMUNICATION, 5)
    assert kept.client.read(0x1017) == 1000


@pytest.mark.parametrize(
    "subindex, kept_values", [(1, (50, 7, 8)), (2, (50, 0, 0)), (3, (1000, 0, 8)), (4, (1000, 7, 0))]
)
def test_groups_are_saved_and_restored_apart(subindex: int, kept_values: tuple[int, ...]) -> None:
    kept = KeptParameters(Store())
    kept.client.write(0x1017, 0, 50)
    kept.client.write(0x2000, 1, 7)
    kept.client.write(0x6000, 1, 8)
    kept.signed(0x1010, subindex, b"save")
    kept.service.apply(NmtCommand.RESET_NODE, 5)
    read = kept.client.read
    assert (read(0x1017), read(0x2000, 1), read(0x6000, 1)) == kept_values
    kept.signed(0x1011, subindex, b"load")
    kept.service.apply(NmtCommand.RESET_NODE, 5)
    assert (read(0x1017), read(0x2000, 1), read(0x6000, 1)) == (1000, 0, 0)


def test_reset_communication_leaves_the_application_alone() -> None:
    kept = KeptParameters(Store())
    kept.client.write(0x1017, 0, 50)
    kept.client.write(0x2000, 1, 7)
    kept.service.apply(NmtCommand.RESET_COMMUNICATION, 5)
    assert (kept.client.read(0x1017), kept.client.read(0x2000, 1)) == (1000, 7)


def test_what_is_not_marked_is_not_stored() -> None:
    kept = KeptParameters(Store())
    kept.client.write(0x1007, 0, 3)
    kept.signed(0x1010, 1, b"save")
    kept.service.apply(NmtCommand.RESET_NODE, 5)
    assert kept.client.read(0x1007) == 0


def test_defaults_follow_the_node_id_and_saved_values_do_not() -> None:
    kept = KeptParameters(Store())
    kept.service.apply(NmtCommand.RESET_COMMUNICATION, 9)
    assert kept.client.read(0x1014) == 0x89
    kept.client.write(0x1014, 0, 0x1A0)
    kept.signed(0x1010, 2, b"save")
    kept.service.apply(NmtCommand.RESET_COMMUNICATION, 5)
    assert kept.client.read(0x1014) == 0x1A0
    assert kept.client.read(0x1800, 1) == 0x185, "the table of PDOs moves these"


def test_pdo_and_manufacturer_values_do_not_outlive_their_layout() -> None:
    store = Store()
    old = KeptParameters(store)
    old.client.write(0x1017, 0, 50)
    old.client.write(0x1800, 1, 0x190)
    old.client.write(0x2000, 1, 7)
    old.signed(0x1010, 1, b"save")
    new = KeptParameters(store, _objects("speed"))
    assert new.client.read(0x1017) == 50
    assert (new.client.read(0x1800, 1), new.client.read(0x2000, 1)) == (0x185, 0)
    assert len(new.reports) == 1
    assert "1800h:01, 2000h:01" in new.reports[0]


def test_another_node_id_is_not_another_layout() -> None:
    moved = _objects()
    moved[3].entries[1].default = U32.pack(0x189)
    assert layout_of(_objects(), 5) == layout_of(moved, 9) != layout_of(moved, 5)


def _with_qualities(*names: str) -> list[Object]:
    entries = (
        Entry(number, f"quality {name}", CanType.UNSIGNED16, Access.RO, bytes(2), pdo=Pdo.TRANSMIT)
        for number, name in enumerate(names, 1)
    )
    return [*_objects(), array(0x5F40, "Status quality", entries)]


def test_the_order_of_variables_counts_where_a_stored_pdo_tells_their_qualities() -> None:
    one, other = _with_qualities("start", "speed"), _with_qualities("speed", "start")
    header, quality = ({(0x1A02, 1): U32.pack(value)} for value in (0x5F00_0710, 0x5F40_0110))
    assert layout_of(one, 5) == layout_of(other, 5) == layout_of(_objects(), 5)
    assert layout_of(one, 5, header) == layout_of(other, 5, header)
    assert layout_of(one, 5, quality) != layout_of(other, 5, quality)


def test_an_operational_node_does_not_wait_for_a_disk() -> None:
    kept = KeptParameters(Store())
    kept.ready = False
    with pytest.raises(Abort) as caught:
        kept.signed(0x1010, 1, b"save")
    assert caught.value.code is AbortCode.DEVICE_STATE


def test_a_disk_that_fails_is_reported_and_nothing_changes(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("where the directory should be")
    kept = KeptParameters(JsonStore(tmp_path / "file" / "file.json"))
    kept.client.write(0x1017, 0, 50)
    assert kept.signed(0x1010, 1, b"save").code is AbortCode.HARDWARE
    assert "cannot be written" in kept.reports[-1]
    kept.service.apply(NmtCommand.RESET_NODE, 5)
    assert kept.client.read(0x1017) == 1000


def test_lss_settings_and_parameters_share_the_file(path: Path) -> None:
    kept = KeptParameters(JsonStore(path))
    answers: list[bool] = []
    kept.service.save_lss(9, 250_000, answers.append)
    assert answers == [True]
    kept.client.write(0x1017, 0, 50)
    kept.signed(0x1010, 1, b"save")
    kept.signed(0x1011, 1, b"load")
    assert KeptParameters(JsonStore(path)).service.lss == LssSettings(9, 5, 250_000)
    assert KeptParameters(JsonStore(path)).service.node == 9
    assert list(path.parent.iterdir()) == [path]


def test_a_mapping_with_another_node_id_wins_over_lss() -> None:
    store = Store()
    store.save(Saved(lss=LssSettings(9, 5)))
    kept = KeptParameters(store, node=6)
    assert (kept.service.node, kept.service.lss) == (6, None)
    assert "node-ID 9 was stored by LSS" in kept.reports[0]


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", "null", "\xff", '{"format": 1}'])
def test_a_damaged_file_means_defaults_a_report_and_a_new_file_with_the_next_save(
    path: Path, text: str
) -> None:
    path.write_text(text, encoding="latin-1")
    kept = KeptParameters(JsonStore(path))
    assert kept.client.read(0x1017) == 1000
    assert (len(kept.reports), kept.failures) == (1, [True])
    assert str(path) in kept.reports[0]
    kept.signed(0x1010, 1, b"save")
    assert kept.failures == [True, False]
    assert JsonStore(path).load().values == {}


def _refused(kept: KeptParameters, index: int = 0x1010, signature: bytes = b"save") -> AbortCode:
    with pytest.raises(Abort) as caught:
        kept.signed(index, 1, signature)
    return caught.value.code


def test_saves_are_refused_when_they_come_faster_than_a_disk_should_write_and_that_is_reported_once() -> None:
    kept = KeptParameters(Store())
    for _ in range(SAVES):
        assert kept.signed(0x1010, 1, b"save").done
    for index, signature in ((0x1010, b"save"), (0x1011, b"load"), (0x1010, b"save")):
        assert _refused(kept, index, signature) is AbortCode.DEVICE_STATE
    answers: list[bool] = []
    kept.service.save_lss(9, None, answers.append)
    assert answers == [False]
    assert len(kept.reports) == 1
    kept.now += 1 / SAVES_PER_SECOND
    assert kept.signed(0x1010, 1, b"save").done


class SlowStore(Store):
    """Writes until the test ends it."""

    def __init__(self) -> None:
        super().__init__()
        self.kept: Kept | None = None

    @property
    def busy(self) -> bool:
        return self.kept is not None

    def keep(self, saved: Saved, kept: Kept) -> None:
        self.save(saved)
        self.kept = kept

    def end(self, error: StoreError | None = None) -> None:
        kept, self.kept = self.kept, None
        assert kept is not None
        kept(error)


def test_one_save_is_written_at_a_time_and_answered_when_it_has_ended() -> None:
    store = SlowStore()
    kept = KeptParameters(store)
    kept.client.write(0x1017, 0, 50)
    pending = kept.signed(0x1010, 1, b"save")
    assert (pending.done, kept.ended) == (False, 0)
    assert _refused(kept) is AbortCode.DEVICE_STATE
    assert _refused(kept, 0x1011, b"load") is AbortCode.DEVICE_STATE
    answers: list[bool] = []
    kept.service.save_lss(9, None, answers.append)
    assert answers == [False]
    store.end()
    assert (pending.done, pending.code, kept.ended) == (True, None, 1)
    assert not kept.signed(0x1010, 1, b"save").done


def test_a_reset_has_what_is_being_written_already() -> None:
    store = SlowStore()
    kept = KeptParameters(store)
    kept.client.write(0x1017, 0, 50)
    kept.signed(0x1010, 1, b"save")
    kept.service.apply(NmtCommand.RESET_COMMUNICATION, 5)
    assert kept.client.read(0x1017) == 50
    store.end(StoreError("full"))
    kept.service.apply(NmtCommand.RESET_COMMUNICATION, 5)
    assert (kept.client.read(0x1017), kept.reports) == (1000, ["full"])

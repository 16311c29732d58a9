"""Parameters that survive a restart: 1010h and 1011h (CiA 301, 7.5.2.13 and .14).

What is saved is what differs from the mapping, so that a changed mapping is not hidden by what was once equal to it.
Saved values come back after every reset, each one only if its entry still exists with that length. The parameters of
PDOs and of manufacturer objects mean something only together with the layout they were saved under: they come back
only under the same one (`layout_of`). What is not taken over is reported and stays in the file until the next save.

LSS keeps its node-ID in the same file. It holds while the mapping names the node-ID that it replaced.

Who saves waits for the disk, and nobody else does: a client is answered when its save has ended. A save that comes
while another one is written is refused, and so are more of them than `SAVES` and `SAVES_PER_SECOND` allow, which would
wear out the disk. A reset in between has what is being written already.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import (
    Abort,
    AbortCode,
    Access,
    Dictionary,
    Entry,
    Object,
    Pdo,
    Pending,
    array,
)
from gatewayd.canopen.nmt import NmtCommand
from gatewayd.links.canopen_node.status_words import HEADER
from gatewayd.links.canopen_node.store import Kept, Key, LssSettings, Saved, Store, StoreError
from gatewayd.loop.allowance import Allowance

ALL = range(0x1000, 0x1_0000)
_COMMUNICATION = range(0x1000, 0x2000)
GROUPS: Mapping[int, tuple[str, range]] = {
    1: ("all parameters", ALL),
    2: ("communication parameters", _COMMUNICATION),
    3: ("application parameters", range(0x6000, 0xA000)),
    4: ("manufacturer parameters", range(0x2000, 0x6000)),
}
"""Sub-indices of 1010h and 1011h."""
_PDOS = range(0x1400, 0x1C00)
_MAPPINGS = range(0x1A00, 0x1C00)
_BOUND_TO_LAYOUT = (_PDOS, range(0x2000, 0x1_0000))
SAVES = 8
"""Saves at once: a master may save and restore each group by itself."""
SAVES_PER_SECOND = 0.5
"""Saves a second after them."""
_SAVE = b"save"
_LOAD = b"load"
_ON_COMMAND = 1
"""Capability: saves and restores on command, never by itself."""


def layout_of(dictionary: Iterable[Object], node: int, values: Mapping[Key, bytes] | None = None) -> int:
    """32 bits that change when the defaults of a PDO change, or an object that it may carry, or one that is stored.

    Defaults that contain the node-ID count without it: another node-ID is not another layout. The status block lies
    where it lies; which variable an entry of its tables stands for counts only where `values` put one into a PDO.
    """
    digest = 0
    tables = any(map(_maps_status_table, (values or {}).items()))
    for item in dictionary:
        if not _is_bound(item.index) or (item.index >= HEADER and not tables):
            continue
        for entry in item.entries:
            if not entry.stored and entry.pdo is Pdo.NONE:
                continue
            default = _rebased(entry, node, 0) if entry.plus_node else entry.default
            text = f"{item.index:x}:{entry.subindex:x} {entry.type.name} {entry.name} {entry.pdo.name} "
            kept = default.hex() if entry.stored else ""
            digest = zlib.crc32((text + kept).encode(), digest)
    return digest


class Parameters:
    """1010h, 1011h and the power-on values of all entries. Reads the store when it is made.

    `node` is the node-ID of the mapping. `ready()` says whether the node may wait for a disk now; `report(text)` is
    called for what could not be taken over, `failed(whether)` when reading the store failed or a save put that right,
    `ended()` when a save that was begun has ended. `clock()`: the moment of the request that is being served.
    """

    def __init__(
        self,
        store: Store,
        node: int,
        *,
        ready: Callable[[], bool],
        report: Callable[[str], None],
        failed: Callable[[bool], None],
        ended: Callable[[], None],
        clock: Callable[[], float],
    ) -> None:
        self._store = store
        self._ended = ended
        self._clock = clock
        self._allowance = Allowance(SAVES, SAVES_PER_SECOND)
        self._is_refusing = False
        self._ready = ready
        self._report = report
        self._failed = failed
        self._planned = node
        self._dictionary: Dictionary | None = None
        self._layout = 0
        self._saved = self._load()
        self._coming: Saved | None = None
        """What is being written."""
        self._node = self.lss.node if self.lss is not None else node

    @property
    def node(self) -> int:
        """The node-ID that the defaults contain now; at first the one to start with."""
        return self._node

    @property
    def lss(self) -> LssSettings | None:
        """What an LSS master has stored."""
        return self._saved.lss

    def objects(self) -> Iterable[Object]:
        """1010h and 1011h."""
        yield array(0x1010, "Store parameters", self._entries("Save", self._save))
        yield array(0x1011, "Restore default parameters", self._entries("Restore", self._restore))

    def bind(self, dictionary: Dictionary) -> None:
        """Take the dictionary whose entries are kept, and drop what no longer fits it."""
        self._dictionary = dictionary
        self._layout = layout_of(dictionary, self._node, self._saved.values)
        kept = {key: value for key, value in self._saved.values.items() if self._fits(key, value)}
        dropped = sorted(self._saved.values.keys() - kept.keys())
        if dropped:
            names = ", ".join(map(_place, dropped))
            self._report(f"stored parameters do not fit this mapping, defaults are used: {names}")
        self._saved = replace(self._saved, values=kept, layout=self._layout)

    def report_differences(self) -> None:
        """Report what was stored and is not what the mapping says."""
        self._report_stored(self._saved.values, "stored parameters are used in place of the mapping's")

    def apply(self, command: NmtCommand, node: int) -> None:
        """Give the entries their power-on values: after "reset communication" those of communication alone.

        Defaults follow `node` before. Those of PDOs are their table's own affair, which has to have followed already.
        """
        assert self._dictionary is not None
        values = (self._coming or self._saved).values
        indices = _COMMUNICATION if command is NmtCommand.RESET_COMMUNICATION else ALL
        for item in self._dictionary:
            for entry in item.entries:
                if entry.plus_node and item.index not in _PDOS:
                    entry.default = _rebased(entry, self._node, node)
                if item.index in indices:
                    entry.value = values.get((item.index, entry.subindex), entry.default)
        self._node = node

    def save_lss(self, node: int, bitrate: int | None, answer: Callable[[bool], None]) -> None:
        """Keep what an LSS master stores, and answer whether that succeeded."""
        if not self._may_save():
            answer(False)
            return
        saved = replace(self._saved, lss=LssSettings(node, self._planned, bitrate))
        self._replace(saved, lambda error: answer(error is None))

    def _load(self) -> Saved:
        try:
            saved = self._store.load()
        except StoreError as error:
            self._report(str(error))
            self._failed(True)
            return Saved()
        lss = saved.lss
        if lss is None or lss.replaces == self._planned:
            return saved
        self._report(
            f"node-ID {lss.node} was stored by LSS in place of {lss.replaces}; "
            f"the mapping names {self._planned} now, which is used"
        )
        return replace(saved, lss=None)

    def _entries(self, verb: str, act: Callable[[range, bytes], Pending]) -> Iterable[Entry]:
        for number, (name, indices) in GROUPS.items():
            yield Entry(
                number,
                f"{verb} {name}",
                CanType.UNSIGNED32,
                Access.RW,
                CanType.UNSIGNED32.pack(_ON_COMMAND),
                sink=partial(act, indices),
            )

    def _save(self, indices: range, signature: bytes) -> Pending:
        """Keep what differs from the defaults now."""
        assert self._dictionary is not None
        self._permit(signature, _SAVE)
        values = {key: value for key, value in self._saved.values.items() if key[0] not in indices}
        for item in self._dictionary:
            if item.index in indices:
                values.update(
                    ((item.index, entry.subindex), entry.value)
                    for entry in item.entries
                    if entry.stored and entry.value != entry.default
                )
        return self._commit(
            values, lambda: self._report_stored(values, "parameters were stored that are not the mapping's")
        )

    def _report_stored(self, values: Mapping[Key, bytes], what: str) -> None:
        assert self._dictionary is not None
        found = [
            _place(key)
            for key, value in sorted(values.items())
            if value != self._dictionary.entry(*key).default
        ]
        if found:
            self._report(f"{what}: {', '.join(found)}")

    def _restore(self, indices: range, signature: bytes) -> Pending:
        """Forget what was saved; the present values stay until the next reset."""
        self._permit(signature, _LOAD)
        left = {key: value for key, value in self._saved.values.items() if key[0] not in indices}
        return self._commit(left, lambda: None)

    def _permit(self, signature: bytes, expected: bytes) -> None:
        if signature != expected:
            raise Abort(AbortCode.CANNOT_STORE)
        if not self._ready() or not self._may_save():
            raise Abort(AbortCode.DEVICE_STATE)

    def _may_save(self) -> bool:
        """Whether the disk can take one more; reported once until it can."""
        may = not self._store.busy and self._allowance.take(self._clock())
        if not may and not self._is_refusing:
            self._report("a master saves parameters faster than they are written: refused (0800 0022h)")
        self._is_refusing = not may
        return may

    def _commit(self, values: Mapping[Key, bytes], succeeded: Callable[[], None]) -> Pending:
        pending = Pending()
        self._layout = layout_of(self._dictionary or (), self._node, values)

        def kept(error: StoreError | None) -> None:
            pending.finish(None if error is None else AbortCode.HARDWARE)
            if error is None:
                succeeded()

        self._replace(replace(self._saved, values=values, layout=self._layout), kept)
        return pending

    def _replace(self, saved: Saved, kept: Kept) -> None:
        def ended(error: StoreError | None) -> None:
            self._coming = None
            if error is None:
                self._saved = saved
                self._failed(False)
            else:
                self._report(str(error))
            kept(error)
            self._ended()

        self._coming = saved
        self._store.keep(saved, ended)

    def _fits(self, key: Key, value: bytes) -> bool:
        assert self._dictionary is not None
        try:
            entry = self._dictionary.entry(*key)
        except Abort:
            return False
        same_layout = self._saved.layout == self._layout or not _is_bound(key[0])
        return entry.stored and same_layout and entry.type.size in (None, len(value))


def _place(key: Key) -> str:
    index, subindex = key
    return f"{index:04X}h:{subindex:02X}"


def _is_bound(index: int) -> bool:
    return any(index in indices for indices in _BOUND_TO_LAYOUT)


def _maps_status_table(item: tuple[Key, bytes]) -> bool:
    (index, subindex), value = item
    return index in _MAPPINGS and subindex > 0 and int.from_bytes(value, "little") >> 16 > HEADER


def _rebased(entry: Entry, old: int, new: int) -> bytes:
    size = len(entry.default)
    return (int.from_bytes(entry.default, "little") - old + new).to_bytes(size, "little")

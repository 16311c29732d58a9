"""Where a node keeps what survives a restart: in memory, or in a file that is written while the loop goes on."""

from __future__ import annotations

import asyncio
import json
import zlib
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from gatewayd.loop.threads import in_daemon_thread
from gatewayd.whole_file import whole_file

FORMAT = 1
"""Version of the file."""

Key = tuple[int, int]
"""Index and sub-index."""


class StoreError(Exception):
    """The file cannot be read or written; the text names it and says why."""


Kept = Callable[[StoreError | None], None]
"""Gets the end of a save, and why it has failed."""


@dataclass(frozen=True, slots=True)
class LssSettings:
    """What an LSS master has stored."""

    node: int
    replaces: int
    """Node-ID that the mapping had then."""
    bitrate: int | None = None
    """Bits per second; None: that of the mapping."""


@dataclass(frozen=True, slots=True)
class Saved:
    """The content of a store."""

    layout: int = 0
    values: Mapping[Key, bytes] = field(default_factory=dict)
    lss: LssSettings | None = None


class Store:
    """Keeps one node's `Saved`; this one no longer than the process lives."""

    def __init__(self) -> None:
        self._saved = Saved()

    @property
    def busy(self) -> bool:
        """Whether a save has not ended yet."""
        return False

    def load(self) -> Saved:
        """What was saved last; empty if nothing was. Raises StoreError."""
        return self._saved

    def save(self, saved: Saved) -> None:
        """Keep it, whole or not at all. Raises StoreError."""
        self._saved = saved

    def keep(self, saved: Saved, kept: Kept) -> None:
        """Save it now or later, and report the end of it. Not while the store is busy."""
        try:
            self.save(saved)
        except StoreError as error:
            kept(error)
        else:
            kept(None)


class JsonStore(Store):
    """A JSON file, replaced as a whole. Saving waits for the disk."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def load(self) -> Saved:
        """The file's content; empty if there is no file."""
        try:
            text = self.path.read_text(encoding="ascii")
        except FileNotFoundError:
            return Saved()
        except (OSError, UnicodeError) as error:
            raise StoreError(f"{self.path}: cannot be read: {error}") from None
        try:
            return _decode(json.loads(text))
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
            raise StoreError(
                f"{self.path}: is damaged ({error!r}): delete it, or save the parameters again"
            ) from None

    def save(self, saved: Saved) -> None:
        """Replace the file once the new one is on the disk. The directory need not exist yet."""
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with whole_file(self.path, overwrite=True) as unfinished:
                unfinished.write_text(json.dumps(_encode(saved), indent=1) + "\n", encoding="ascii")
        except OSError as error:
            raise StoreError(f"{self.path}: cannot be written: {error}") from None


class BackgroundStore(JsonStore):
    """The same for a running loop, which does not wait: `keep` writes in a thread."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._keeping: asyncio.Task[None] | None = None
        self._coming = Saved()
        """What is being written."""

    @property
    def busy(self) -> bool:
        """Whether the file is being written."""
        return self._keeping is not None

    def load(self) -> Saved:
        """The file's content, as it will be."""
        return self._coming if self.busy else super().load()

    def keep(self, saved: Saved, kept: Kept) -> None:
        """Write it in a thread."""
        assert not self.busy
        self._coming = saved
        self._keeping = asyncio.get_running_loop().create_task(self._keep(saved, kept))

    async def _keep(self, saved: Saved, kept: Kept) -> None:
        failure: StoreError | None = None
        try:
            await in_daemon_thread(lambda: self.save(saved), "canopen parameters")
        except StoreError as error:
            failure = error
        finally:
            self._keeping = None
        kept(failure)


def _encode(saved: Saved) -> dict[str, Any]:
    lss = saved.lss
    content: dict[str, Any] = {
        "layout": saved.layout,
        "values": {
            f"{index:04x}:{sub:02x}": value.hex() for (index, sub), value in sorted(saved.values.items())
        },
        "lss": None if lss is None else asdict(lss),
    }
    return {"format": FORMAT, "checksum": _checksum(content), **content}


def _decode(document: dict[str, Any]) -> Saved:
    content = {key: document[key] for key in ("layout", "values", "lss")}
    if document["format"] != FORMAT or document["checksum"] != _checksum(content):
        raise ValueError("wrong format or checksum")
    values = {}
    for key, value in content["values"].items():
        index, _, sub = key.partition(":")
        values[int(index, 16), int(sub, 16)] = bytes.fromhex(value)
    lss = content["lss"]
    return Saved(content["layout"], values, None if lss is None else LssSettings(**lss))


def _checksum(content: Mapping[str, Any]) -> int:
    return zlib.crc32(json.dumps(content, sort_keys=True).encode())

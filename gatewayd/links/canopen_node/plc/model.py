"""What a PLC program needs of the PDOs of a node: the neutral model that every target writes down.

TPDOs and RPDOs are called as the node calls them: a TPDO comes from the robot, an RPDO goes to it.
"""

from __future__ import annotations

from dataclasses import dataclass

from gatewayd.plc.model import CellModel, Tag


@dataclass(frozen=True, slots=True)
class PdoTag(Tag):
    """One variable as the PLC sees it, and its place in a PDO."""

    pdo: str
    """Name of the PDO in the image: `tpdo1`."""
    start: int
    """Its first bit, from the lowest one of the first byte on."""
    index: int
    subindex: int

    @property
    def byte(self) -> int:
        """The byte in which it begins."""
        return self.start // 8

    @property
    def notation(self) -> str:
        """Where it lies, for people: `TPDO 2 byte 4 (2430h:01)`, `RPDO 1 byte 0 bit 3 (2000h:04)`."""
        part = f" bit {self.start % 8}" if self.encoding is None else ""
        name = f"{self.pdo[:4].upper()} {self.pdo[4:]}"
        return f"{name} byte {self.byte}{part} ({self.index:04X}h:{self.subindex:02X})"

    def type_in_mapping(self, name: str) -> str:
        """As CiA 301 calls it: `INTEGER16`."""
        return name.replace("uint", "UNSIGNED").replace("int", "INTEGER").replace("float", "REAL")

    @property
    def object_name(self) -> str:
        """Of the member of the PDO's structure: arrays over several PDOs there are none."""
        return self.member if self.element is None else f"{self.member}_{self.element}"


@dataclass(frozen=True, slots=True)
class PdoWord:
    """A word of the status block in a TPDO."""

    field: str
    """As the status block calls it; `quality`: of a variable."""
    number: int
    """Of that variable; 0 for a field of the header."""
    about: str
    """In words."""
    pdo: str
    start: int
    words: int
    """16 bits each."""
    index: int
    subindex: int

    @property
    def byte(self) -> int:
        """The byte in which it begins."""
        return self.start // 8

    @property
    def object_name(self) -> str:
        """Of the member of the PDO's structure."""
        return f"quality_{self.number}" if self.number else f"status_{self.field}"


@dataclass(frozen=True, slots=True)
class PdoImage:
    """One PDO."""

    name: str
    """`tpdo1`, `rpdo12`."""
    transmits: bool
    """It is a TPDO."""
    cob_id: int
    size: int
    """Bytes."""
    how: str
    """When it is sent, in words."""
    tags: tuple[PdoTag, ...]
    words: tuple[PdoWord, ...]

    @property
    def entries(self) -> tuple[PdoTag | PdoWord, ...]:
        """What it carries, in the order of its bits."""
        entries: tuple[PdoTag | PdoWord, ...] = (*self.tags, *self.words)
        return tuple(sorted(entries, key=lambda entry: entry.start))


@dataclass(frozen=True, slots=True)
class PdoModel(CellModel):
    """A cell for one PLC that is the master of its node."""

    node: int
    bitrate: int
    pdos: tuple[PdoImage, ...]

    @property
    def from_node(self) -> tuple[PdoImage, ...]:
        """What the master receives."""
        return tuple(pdo for pdo in self.pdos if pdo.transmits)

    @property
    def to_node(self) -> tuple[PdoImage, ...]:
        """What the master sends."""
        return tuple(pdo for pdo in self.pdos if not pdo.transmits)

    def word(self, field: str) -> PdoWord | None:
        """A field of the status block's header; None where no TPDO has it."""
        words = (word for pdo in self.from_node for word in pdo.words)
        return next((word for word in words if word.field == field and not word.number), None)

    @property
    def qualities(self) -> tuple[PdoWord, ...]:
        """The qualities of variables, by number."""
        words = (word for pdo in self.from_node for word in pdo.words if word.number)
        return tuple(sorted(words, key=lambda word: word.number))

"""How a master hands over the content of PDOs, as structured text reads and writes it: bytes, or typed objects."""

from __future__ import annotations

import struct
from collections.abc import Generator, Iterator
from itertools import groupby
from typing import Final, Protocol

from gatewayd.links.canopen_node.plc.model import PdoImage, PdoModel, PdoTag, PdoWord
from gatewayd.links.canopen_node.plc.pdo_text import about
from gatewayd.plc.model import Encoding, TagFamily
from gatewayd.plc.numbers import NUMBERS, REALS
from gatewayd.plc.st.dialect import Dialect, array, elementary, own
from gatewayd.plc.st.program import PlcVariable, Structure
from gatewayd.plc.st.scaling import from_bits, raw_of, value_of
from gatewayd.plc.st.types import description


class Content(Protocol):
    """One of the two."""

    def types(self, model: PdoModel) -> Iterator[Structure]:
        """What else the two structures of all TPDOs and of all RPDOs need."""

    def member(self, model: PdoModel, pdo: PdoImage) -> PlcVariable:
        """The PDO in its structure."""

    def read(self, tag: PdoTag, model: PdoModel, dialect: Dialect) -> Iterator[str]:
        """Statements that bring a value from `from_node` to `outputs`."""

    def write(self, pdo: PdoImage, model: PdoModel, dialect: Dialect) -> Iterator[str]:
        """Statements that bring all values of an RPDO from `inputs` to `to_node`."""

    def word(self, word: PdoWord, model: PdoModel, dialect: Dialect) -> str:
        """A word of the status as a WORD, or a DWORD where it has two."""


def octet(number: int) -> str:
    """A BYTE."""
    return f"BYTE#16#{number:02X}"


class Bytes:
    """Raw bytes, the first of the frame first: what the standard knows."""

    def types(self, _model: PdoModel) -> Iterator[Structure]:
        """None."""
        yield from ()

    def member(self, _model: PdoModel, pdo: PdoImage) -> PlcVariable:
        """An array of bytes."""
        return PlcVariable(pdo.name, array("BYTE", pdo.size - 1), about(pdo))

    def read(self, tag: PdoTag, model: PdoModel, dialect: Dialect) -> Iterator[str]:
        """Least significant byte first (CiA 301, 7.1)."""
        target, place = f"outputs.{tag.path}", f"from_node.{tag.pdo}"
        if tag.encoding is None:
            yield f"{target} := ({place}[{tag.byte}] AND {octet(1 << tag.start % 8)}) <> {octet(0)};"
            return
        number = NUMBERS[tag.encoding.type]
        if number.size == 1:
            yield f"{target} := {value_of(f'BYTE_TO_{number.type}({place}[{tag.byte}])', tag)};"
        elif number.size == 2:
            word = _joined(place, tag.byte, 2, model, dialect)
            yield f"{target} := {value_of(f'WORD_TO_{number.type}({word})', tag)};"
        else:
            bits = "double" if number.size == 4 else "quad"
            yield f"{bits} := {_joined(place, tag.byte, number.size, model, dialect)};"
            yield from from_bits(target, bits, tag, model, dialect)

    def write(self, pdo: PdoImage, model: PdoModel, dialect: Dialect) -> Iterator[str]:
        """Bits of a byte are put together first."""
        place = f"to_node.{pdo.name}"
        bits = [tag for tag in pdo.tags if tag.encoding is None]
        for byte, tags in groupby(bits, key=lambda tag: tag.byte):
            yield f"octet := {octet(0)};"
            for tag in tags:
                yield f"IF inputs.{tag.path} THEN octet := octet OR {octet(1 << tag.start % 8)}; END_IF;"
            yield f"{place}[{byte}] := octet;"
        for tag in pdo.tags:
            if tag.encoding is not None:
                octets = yield from _split(tag, tag.encoding, model, dialect)
                for at, each in enumerate(octets):
                    yield f"{place}[{tag.byte + at}] := {each};"

    def word(self, word: PdoWord, model: PdoModel, dialect: Dialect) -> str:
        """Two bytes, or four."""
        return _joined(f"from_node.{word.pdo}", word.byte, 2 * word.words, model, dialect)


def _joined(place: str, at: int, count: int, model: PdoModel, dialect: Dialect) -> str:
    words = [
        dialect.call(model, "Word", low=f"{place}[{at + offset}]", high=f"{place}[{at + offset + 1}]")
        for offset in range(0, count, 2)
    ]
    if len(words) == 1:
        return words[0]
    names = ("high", "low") if len(words) == 2 else ("a", "b", "c", "d")
    function = "Double" if len(words) == 2 else "Quad"
    return dialect.call(model, function, **dict(zip(names, reversed(words), strict=True)))


def _split(
    tag: PdoTag, encoding: Encoding, model: PdoModel, dialect: Dialect
) -> Generator[str, None, list[str]]:
    """The bytes of a number, the least significant first."""
    number = NUMBERS[encoding.type]
    if tag.type == "BOOL":
        return (yield from _truth(tag, encoding))
    raw = yield from raw_of(tag, encoding)
    if number.size == 1:
        return [f"{number.type}_TO_BYTE({raw})"]
    bits, kind = {2: ("value", "WORD"), 4: ("double", "DWORD"), 8: ("quad", "LWORD")}[number.size]
    is_real = number.type in REALS
    made = (
        dialect.call(model, f"From{number.type.capitalize()}", value=raw)
        if is_real
        else f"{number.type}_TO_{kind}({raw})"
    )
    yield f"{bits} := {made};"
    return [
        f"{kind}_TO_BYTE({dialect.shift('SHR', bits, str(by)) if by else bits} AND {kind}#16#FF)"
        for by in range(0, 8 * number.size, 8)
    ]


_ONE: Final = {"float32": struct.pack("<f", 1.0), "float64": struct.pack("<d", 1.0)}


def _truth(tag: PdoTag, encoding: Encoding) -> Generator[str, None, list[str]]:
    """TRUE is the number 1."""
    one = _ONE.get(encoding.type, (1).to_bytes(NUMBERS[encoding.type].size, "little"))
    yield f"value := {_word(0)};"
    yield f"IF inputs.{tag.path} THEN value := {_word(0xFF)}; END_IF;"
    return [f"WORD_TO_BYTE(value AND {_word(each)})" if each else octet(0) for each in one]


def _word(number: int) -> str:
    return f"WORD#16#{number:04X}"


class Objects:
    """Variables of the objects' types: masters that read the EDS hand over these."""

    def types(self, model: PdoModel) -> Iterator[Structure]:
        """A structure for each PDO."""
        for pdo in model.pdos:
            yield Structure(_type_of(model, pdo), tuple(map(_object, pdo.entries)), about(pdo))

    def member(self, model: PdoModel, pdo: PdoImage) -> PlcVariable:
        """The structure of the PDO."""
        return PlcVariable(pdo.name, own(_type_of(model, pdo)), about(pdo))

    def read(self, tag: PdoTag, _model: PdoModel, _dialect: Dialect) -> Iterator[str]:
        """The raw number with scale and offset."""
        raw = f"from_node.{tag.pdo}.{tag.object_name}"
        yield f"outputs.{tag.path} := {raw if tag.encoding is None else value_of(raw, tag)};"

    def write(self, pdo: PdoImage, _model: PdoModel, _dialect: Dialect) -> Iterator[str]:
        """The raw number of each value."""
        for tag in pdo.tags:
            target, source = f"to_node.{pdo.name}.{tag.object_name}", f"inputs.{tag.path}"
            if tag.encoding is None:
                yield f"{target} := {source};"
            elif tag.type == "BOOL":
                yield f"{target} := 0;"
                yield f"IF {source} THEN {target} := 1; END_IF;"
            else:
                raw = yield from raw_of(tag, tag.encoding)
                yield f"{target} := {raw};"

    def word(self, word: PdoWord, _model: PdoModel, _dialect: Dialect) -> str:
        """The object as bits."""
        kind = "UINT_TO_WORD" if word.words == 1 else "UDINT_TO_DWORD"
        return f"{kind}(from_node.{word.pdo}.{word.object_name})"


def _type_of(model: PdoModel, pdo: PdoImage) -> str:
    return f"{model.prefix}_{pdo.name.capitalize()}"


def _object(entry: PdoTag | PdoWord) -> PlcVariable:
    if isinstance(entry, PdoWord):
        kind = "UINT" if entry.words == 1 else "UDINT"
        text = f"byte {entry.byte} ({entry.index:04X}h:{entry.subindex:02X}): {entry.about}"
        return PlcVariable(entry.object_name, elementary(kind), text)
    kind = "BOOL" if entry.encoding is None else NUMBERS[entry.encoding.type].type
    return PlcVariable(
        entry.object_name, elementary(kind), description(TagFamily(entry.name, entry.type, (entry,)))
    )

"""C99 for soft PLCs and test benches: one header with functions on the bytes of the PDOs.

The arithmetic is the gateway's own, in `double`, halves rounded to even. The header is what the tests compile and run
against a node: the tables of all targets are the same.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import Final

from gatewayd.links.canopen_node.plc.model import PdoImage, PdoModel, PdoTag, PdoWord
from gatewayd.links.canopen_node.plc.pdo_text import about, pdo_lines
from gatewayd.links.exports import ExportedFile
from gatewayd.plc.c import HELPERS, bits_of, comment, enumerations, structure, value_of
from gatewayd.plc.header import header, overview
from gatewayd.plc.keywords import C
from gatewayd.plc.model import Encoding
from gatewayd.plc.names import Holds
from gatewayd.plc.numbers import NUMBERS

HOLDS: Final = Holds("C", 63, C)
_BYTES: Final = """\
static inline uint64_t {p}_get(const uint8_t *byte, int count)
{{
    uint64_t number = 0;
    for (int i = count - 1; i >= 0; i--)
        number = number << 8 | byte[i];
    return number;
}}

static inline void {p}_put(uint8_t *byte, int count, uint64_t number)
{{
    for (int i = 0; i < count; i++, number >>= 8)
        byte[i] = (uint8_t)number;
}}

"""


def files(model: PdoModel) -> Iterator[ExportedFile]:
    """The header."""
    yield ExportedFile(f"{model.prefix.lower()}.h", "\n".join(_lines(model)) + "\n")


def _lines(model: PdoModel) -> Iterator[str]:
    prefix, capitals = model.prefix.lower(), model.prefix.upper()
    for line in (*header(model, "C"), *overview(model), *pdo_lines(model)):
        yield comment(line)
    yield from (f"#ifndef {capitals}_H", f"#define {capitals}_H", "")
    yield from (f"#include <{name}.h>" for name in ("float", "math", "stdbool", "stdint", "string"))
    yield from ("", f"#define {capitals}_FINGERPRINT UINT32_C(0x{model.fingerprint:08X})")
    for pdo in model.pdos:
        yield f"#define {capitals}_{pdo.name.upper()}_COB_ID 0x{pdo.cob_id:03X}"
    yield from enumerations(prefix)
    yield from structure(prefix, "inputs", model.inputs)
    yield from structure(prefix, "outputs", model.outputs)
    yield from _frames(prefix, "from_node", model.from_node)
    yield from _frames(prefix, "to_node", model.to_node)
    found = {word.object_name: word for pdo in reversed(model.from_node) for word in reversed(pdo.words)}
    words = [found[name] for name in reversed(found)]
    yield from _status_structure(prefix, words)
    yield from ("", _BYTES.format(p=prefix) + HELPERS.format(p=prefix))
    yield from _functions(model, prefix)
    yield from _status_function(prefix, words)
    yield from ("", "#endif")


def _frames(prefix: str, name: str, pdos: Sequence[PdoImage]) -> Iterator[str]:
    if pdos:
        yield from ("", f"struct {prefix}_{name} {{")
        for pdo in pdos:
            yield f"    uint8_t {pdo.name}[{pdo.size}]; {comment(about(pdo))}"
        yield "};"


def _status_structure(prefix: str, words: Sequence[PdoWord]) -> Iterator[str]:
    if words:
        yield from ("", f"struct {prefix}_status {{")
        for word in words:
            yield f"    uint{16 * word.words}_t {word.object_name}; {comment(word.about)}"
        yield "};"


def _status_function(prefix: str, words: Sequence[PdoWord]) -> Iterator[str]:
    if words:
        yield ""
        yield (
            f"static inline void {prefix}_decode_status"
            f"(const struct {prefix}_from_node *from_node, struct {prefix}_status *status)"
        )
        yield "{"
        for word in words:
            bits = f"{prefix}_get(from_node->{word.pdo} + {word.byte}, {2 * word.words})"
            yield f"    status->{word.object_name} = (uint{16 * word.words}_t){bits};"
        yield "}"


def _functions(model: PdoModel, prefix: str) -> Iterator[str]:
    if model.outputs:
        yield (
            f"static inline void {prefix}_unpack"
            f"(const struct {prefix}_from_node *from_node, struct {prefix}_outputs *outputs)"
        )
        yield "{"
        for family in model.outputs:
            for tag in family.tags:
                assert isinstance(tag, PdoTag)
                yield f"    outputs->{tag.path} = {value_of(_raw(tag, prefix), tag)};"
        yield "}"
    if model.outputs and model.inputs:
        yield ""
    if model.inputs:
        yield (
            f"static inline void {prefix}_pack"
            f"(const struct {prefix}_inputs *inputs, struct {prefix}_to_node *to_node)"
        )
        yield "{"
        for pdo in model.to_node:
            yield from (f"    {line}" for line in _packed(pdo, prefix))
        yield "}"


def _raw(tag: PdoTag, prefix: str) -> str:
    place = f"from_node->{tag.pdo}"
    if tag.encoding is None:
        return f"({place}[{tag.byte}] >> {tag.start % 8} & 1) != 0"
    number = NUMBERS[tag.encoding.type]
    bits = f"{prefix}_get({place} + {tag.byte}, {number.size})"
    if number.is_real:
        return f"{prefix}_{'float' if number.size == 4 else 'double'}({bits})"
    return f"({tag.encoding.type}_t){bits}"


def _packed(pdo: PdoImage, prefix: str) -> Iterator[str]:
    bits = [tag for tag in pdo.tags if tag.encoding is None]
    for byte, tags in groupby(bits, key=lambda tag: tag.byte):
        parts = " | ".join(f"inputs->{tag.path} << {tag.start % 8}" for tag in tags)
        yield f"to_node->{pdo.name}[{byte}] = (uint8_t)({parts});"
    for tag in pdo.tags:
        if tag.encoding is not None:
            yield _put(tag, tag.encoding, prefix)


def _put(tag: PdoTag, encoding: Encoding, prefix: str) -> str:
    size = NUMBERS[encoding.type].size
    return f"{prefix}_put(to_node->{tag.pdo} + {tag.byte}, {size}, {bits_of(tag, encoding, prefix)});"

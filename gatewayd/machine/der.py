"""DER (ITU-T X.690), as much of it as reading an X.509 certificate takes: elements one within the other.

Pure. Whatever the bytes are, reading ends: a length never reaches beyond the element around it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

BOOLEAN = 0x01
INTEGER = 0x02
OCTET_STRING = 0x04
OBJECT_IDENTIFIER = 0x06
UTF8_STRING = 0x0C
SEQUENCE = 0x30
SET = 0x31
UTC_TIME = 0x17
GENERALIZED_TIME = 0x18

_MAX_LENGTH_BYTES = 4
_MAX_IDENTIFIER = 64
"""Bytes of an object identifier; those of certificates have about ten."""


class DerError(ValueError):
    """Bytes that are not DER, or not what they were taken for."""


@dataclass(frozen=True, slots=True)
class Element:
    """One element: its tag (one byte, number and class), its content, and its bytes with tag and length."""

    tag: int
    content: bytes
    whole: bytes

    def expect(self, tag: int) -> Element:
        """The same element, if it has this tag. Raises DerError."""
        if self.tag != tag:
            raise DerError(f"tag {self.tag:#04x} where {tag:#04x} was expected")
        return self

    def __iter__(self) -> Iterator[Element]:
        return elements(self.content)


def elements(data: bytes) -> Iterator[Element]:
    """The elements that follow one another in `data`. Raises DerError where they end in the middle of one."""
    begin = 0
    while begin < len(data):
        end = _end(data, begin)
        content = data[_header_end(data, begin) : end]
        yield Element(data[begin], content, data[begin:end])
        begin = end


def only(data: bytes) -> Element:
    """The one element that `data` is. Raises DerError."""
    found = list(elements(data))
    if len(found) != 1:
        raise DerError(f"{len(found)} elements where there should be one")
    return found[0]


def identifier(element: Element) -> str:
    """An object identifier in dotted decimals (X.690, 8.19). Raises DerError."""
    content = element.expect(OBJECT_IDENTIFIER).content
    if not content or len(content) > _MAX_IDENTIFIER or content[-1] & 0x80:
        raise DerError("not an object identifier")
    numbers, number = [], 0
    for byte in content:
        if not number and byte == 0x80:
            raise DerError("an object identifier with leading zeros")
        number = number << 7 | byte & 0x7F
        if not byte & 0x80:
            numbers.append(number)
            number = 0
    first = min(numbers[0] // 40, 2)
    return ".".join(map(str, (first, numbers[0] - 40 * first, *numbers[1:])))


def _header_end(data: bytes, begin: int) -> int:
    """Where the content of the element begins (X.690, 8.1.2 and 8.1.3)."""
    if data[begin] & 0x1F == 0x1F:
        raise DerError("a tag of several bytes")
    if begin + 1 >= len(data):
        raise DerError("an element without a length")
    first = data[begin + 1]
    return begin + 2 + (first & 0x7F if first & 0x80 else 0)


def _end(data: bytes, begin: int) -> int:
    content = _header_end(data, begin)
    count = content - begin - 2
    if content > len(data) or count > _MAX_LENGTH_BYTES:
        raise DerError("a length that is cut off or too long")
    length = int.from_bytes(data[begin + 2 : content]) if count else data[begin + 1]
    if data[begin + 1] == 0x80 or (count and (length < 0x80 or length >> 8 * (count - 1) == 0)):
        raise DerError("a length that DER does not write so")
    if content + length > len(data):
        raise DerError("an element that is cut off")
    return content + length

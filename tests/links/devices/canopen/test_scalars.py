"""What a mapping file may write for objects, PDOs and identities."""

from __future__ import annotations

import pytest

from gatewayd.links.devices.canopen.scalars import IdentityNumber, ObjectIndex, PdoNumber
from gatewayd.mapping.tables import read
from gatewayd.mapping.typed import Invalid


@pytest.mark.parametrize(
    "kind, text, value",
    [
        (ObjectIndex, "0x6004", 0x6004),
        (ObjectIndex, "0x1000", 0x1000),
        (IdentityNumber, "0x00010002", 0x10002),
        (IdentityNumber, "12", 12),
        (IdentityNumber, "4294967295", 0xFFFF_FFFF),
        (PdoNumber, "none", "none"),
        (PdoNumber, "512", 512),
    ],
)
def test_read(kind: object, text: str, value: object) -> None:
    assert read(kind, text) == value


@pytest.mark.parametrize(
    "kind, text, message",
    [
        (ObjectIndex, "6004", "not the index of an object"),
        (ObjectIndex, "0x0FFF", "not between 0x1000 and 0xFFFF"),
        (ObjectIndex, "0x10000", "not between 0x1000 and 0xFFFF"),
        (IdentityNumber, "x", "not a number of 32 bits"),
        (IdentityNumber, "4294967296", "more than 32 bits"),
        (PdoNumber, "0", "not the number of a PDO"),
        (PdoNumber, "513", "not the number of a PDO"),
        (PdoNumber, "all", "not the number of a PDO"),
    ],
)
def test_refused(kind: object, text: str, message: str) -> None:
    with pytest.raises(Invalid) as refused:
        read(kind, text)
    assert message in refused.value.mistakes[0].context["message"]

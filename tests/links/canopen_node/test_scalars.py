"""The small languages of the CANopen part of a mapping."""

from __future__ import annotations

from typing import Any

import pytest

from gatewayd.links.canopen_node.scalars import (
    CobId,
    CobIdRanges,
    InhibitTime,
    Member,
    Members,
    MillisecondTime,
    Transmission,
)
from gatewayd.mapping import tables
from gatewayd.mapping.source import parse
from gatewayd.mapping.typed import Invalid
from tests.mapping.values import plain


def yaml(text: str) -> Any:
    source = parse(f"a: {text}".encode(), "f")
    assert source.root is not None
    tree: Any = plain(source.root)
    return tree["a"]


def read(kind: Any, text: str) -> Any:
    return tables.read(kind, yaml(text))


def refused(kind: Any, text: str) -> tuple[str, str]:
    with pytest.raises(Invalid) as caught:
        read(kind, text)
    mistake = caught.value.mistakes[0]
    return mistake.kind, mistake.context["hint"]


@pytest.mark.parametrize("text, number", [("0x1A0", 0x1A0), ("0x1a0", 0x1A0), ("'0x7FF'", 0x7FF), ("0x0", 0)])
def test_cob_ids_are_hexadecimal(text: str, number: int) -> None:
    assert read(CobId, text) == number


@pytest.mark.parametrize("text", ["416", "180h", "$NODEID+0x180", "0x", "0x1G0"])
def test_other_spellings_of_a_cob_id_are_refused(text: str) -> None:
    assert refused(CobId, text)[0] == "bad-cob-id"


def test_a_decimal_cob_id_is_shown_both_ways() -> None:
    """It may have been meant as decimal or as hexadecimal: nobody guesses."""
    hint = "COB-IDs are hexadecimal here: 0x1A0, or 0x416 if 416 was meant so"
    assert refused(CobId, "416")[1] == hint


def test_only_11_bits() -> None:
    assert refused(CobId, "0x800")[0] == "out-of-range"


def test_ranges_of_cob_ids() -> None:
    assert read(CobIdRanges, "0x1A0") == (range(0x1A0, 0x1A1),)
    assert read(CobIdRanges, "[0x1A0..0x1AF, 0x2A0]") == (range(0x1A0, 0x1B0), range(0x2A0, 0x2A1))
    assert refused(CobIdRanges, "0x1AF..0x1A0")[0] == "bad-cob-id"


@pytest.mark.parametrize(
    "text, number", [("event", 254), ("sync", 1), ("0", 0), ("240", 240), ("254", 254), ("255", 255)]
)
def test_transmission_types(text: str, number: int) -> None:
    assert read(Transmission, text) == number


@pytest.mark.parametrize(
    "text, slug",
    [
        ("241", "out-of-range"),
        ("252", "out-of-range"),
        ("256", "out-of-range"),
        ("cyclic", "bad-choice"),
        ("0x10", "bad-choice"),
        ("1.5", "bad-choice"),
        ("[1]", "wrong-type"),
    ],
)
def test_other_transmission_types_are_refused(text: str, slug: str) -> None:
    """Remote-requested PDOs and reserved types too."""
    assert refused(Transmission, text)[0] == slug


def test_times_are_what_the_timers_of_a_node_hold() -> None:
    assert read(MillisecondTime, "65.535s") == 65.535
    assert read(MillisecondTime, "none") is None
    assert read(InhibitTime, "0.3ms") == pytest.approx(0.0003)
    assert refused(MillisecondTime, "0.5ms")[0] == "bad-duration"
    assert refused(InhibitTime, "0.25ms")[0] == "bad-duration"
    assert refused(InhibitTime, "7s") == (
        "out-of-range",
        "CANopen counts this time in tenths of a millisecond with 16 bits: at most 6.5535s",
    )
    assert refused(MillisecondTime, "66s")[0] == "out-of-range"


def test_members() -> None:
    assert read(Members, "start") == (Member("start", "start"),)
    assert read(Members, "[start, 'recipe[3]', 'recipe[0..7]']") == (
        Member("start", "start"),
        Member("recipe[3]", "recipe", range(3, 4)),
        Member("recipe[0..7]", "recipe", range(8)),
    )
    assert refused(Members, "'recipe[7..0]'")[0] == "bad-range"
    assert refused(Members, "recipe.3")[0] == "bad-name"
    assert refused(Members, "[]")[0] == "wrong-type"


def test_lists_have_an_end() -> None:
    """A PDO has 64 entries at most."""
    for kind, item, most in ((Members, "a", 64), (CobIdRanges, "0x680", 256)):
        tables.read(kind, yaml(f"[{', '.join([item] * most)}]"))
        with pytest.raises(Invalid):
            tables.read(kind, yaml(f"[{', '.join([item] * (most + 1))}]"))

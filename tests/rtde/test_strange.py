from __future__ import annotations

from gatewayd.rtde.strange import Oddity, StrangeCounts, StrangePackage


def test_each_is_counted_and_the_first_of_its_oddity_and_type_reported() -> None:
    counts = StrangeCounts()
    unknown = StrangePackage(Oddity.UNKNOWN_TYPE, 82, "unknown package type 82")
    assert [counts.count(unknown) for _ in range(3)] == [True, False, False]
    assert counts.count(StrangePackage(Oddity.UNKNOWN_TYPE, 83, "unknown package type 83"))
    assert counts.count(StrangePackage(Oddity.LAYOUT, 82, "another oddity"))
    assert counts.by_oddity == {
        Oddity.UNKNOWN_TYPE: 4,
        Oddity.LAYOUT: 1,
        Oddity.RECIPE: 0,
        Oddity.UNEXPECTED: 0,
    }
    assert counts.total == 5


def test_a_controller_that_makes_up_types_fills_no_log() -> None:
    counts = StrangeCounts()
    reported = [counts.count(StrangePackage(Oddity.UNKNOWN_TYPE, kind, "")) for kind in range(256)]
    assert (sum(reported), counts.total) == (64, 256)


def test_for_people_it_shows_its_first_bytes() -> None:
    assert str(StrangePackage(Oddity.LAYOUT, 83, "too long", b"\x00\x05")) == "too long: 00 05"
    assert str(StrangePackage(Oddity.UNEXPECTED, 80, "not asked for")) == "not asked for"

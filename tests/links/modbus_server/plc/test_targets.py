"""What each target writes: as the golden files have it, the same every time, nothing of other makes in it."""

from __future__ import annotations

import pytest

from gatewayd.links.exports import is_as_generated
from gatewayd.links.modbus_server.plc.model import PlcModel
from gatewayd.links.modbus_server.plc.registry import files_for
from gatewayd.plc.export import TARGETS
from gatewayd.plc.tags import PlcWishes
from tests.links.modbus_server.plc.cells import model
from tests.plc_golden import GOLDEN, golden_model, made

EVERY_TARGET = pytest.mark.parametrize("target", sorted(TARGETS))


def great() -> PlcModel:
    """As many variables as a cell may have."""
    names = (
        "output_bit_register_0..63",
        "input_bit_register_0..63",
        "output_int_register_0..23",
        "input_int_register_0..23",
        "output_double_register_0..23",
    )
    places = ("100.0", "0.0", "200", "50", "300")
    return model(
        *(
            f"a{index}: {{robot: '{robot}', modbus: {place}{', owner: plc' if robot.startswith('in') else ''}}}"
            for index, (robot, place) in enumerate(zip(names, places, strict=True))
        )
    )


def test_golden_files() -> None:
    """After a change that is meant: `python -m tests.plc_golden`."""
    expected = made()
    there = {path for path in GOLDEN.rglob("*") if path.is_file() and path.parent != GOLDEN}
    assert there == set(expected)
    for path, content in expected.items():
        assert path.read_bytes() == content, path.relative_to(GOLDEN)


@EVERY_TARGET
def test_generated_files_know_that_they_are(target: str) -> None:
    for file in files_for(target, golden_model()):
        assert is_as_generated(file.content()) != file.once, file.name


@EVERY_TARGET
def test_files_have_names_of_their_own(target: str) -> None:
    names = [file.name for file in files_for(target, golden_model())]
    assert len(set(names)) == len(names)


@EVERY_TARGET
def test_texts_of_the_mapping_never_leave_their_comment(target: str) -> None:
    """TIA Portal's comments end with the line: what follows would be code."""
    found = model(
        r"""a: {robot: output_int_register_0, modbus: 1, unit: "s\nOUTSIDE", comment: "x\r\nOUTSIDE\u2028OUTSIDE"}"""
    )
    text = b"".join(file.content() for file in files_for(target, found)).decode("utf-8-sig")
    assert "OUTSIDE" in text
    assert not any(line.startswith("OUTSIDE") for line in text.splitlines())


@EVERY_TARGET
def test_a_great_cell(target: str) -> None:
    text = b"".join(file.content() for file in files_for(target, great()))
    assert b"a4[23]" in text


@EVERY_TARGET
def test_a_program_that_only_reads_writes_nothing(target: str) -> None:
    found = model("ready: {robot: output_bit_register_0, modbus: 100.0}", wishes=PlcWishes(writer="none"))
    files = files_for(target, found)
    assert not any(b"write1" in file.content() for file in files)


@EVERY_TARGET
def test_comments_keep_their_letters_and_end_where_they_should(target: str) -> None:
    text = "".join(file.content().decode(file.encoding) for file in files_for(target, golden_model()))
    assert "größte Kraft" in text
    assert "(* der Presse *)" not in text or target not in ("iec-st", "twincat")

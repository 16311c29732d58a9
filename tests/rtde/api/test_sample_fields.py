"""The typed names of samples are those of the catalogue; `python -m tests.rtde.api.test_sample_fields` renews them."""

from __future__ import annotations

from pathlib import Path

from gatewayd.rtde.api import sample_fields
from gatewayd.rtde.api.sample import Sample
from gatewayd.rtde.fields import OUTPUTS
from gatewayd.rtde.types import DataType

PATH = Path(sample_fields.__file__)
MARK = "    # -- generated: the outputs of gatewayd.rtde.fields --\n"
WORDS = {
    DataType.BOOL: "bool",
    DataType.DOUBLE: "float",
    DataType.VECTOR3D: "Vector3D",
    DataType.VECTOR6D: "Vector6D",
    DataType.VECTOR6INT32: "Vector6Int",
    DataType.VECTOR6UINT32: "Vector6Int",
}


def lines() -> str:
    return "".join(f"    {name}: {WORDS.get(field.type, 'int')}\n" for name, field in OUTPUTS.items())


def test_every_output_of_the_catalogue_has_its_type() -> None:
    assert PATH.read_text().partition(MARK)[2] == lines()


def test_the_names_take_no_place_in_a_sample() -> None:
    assert not hasattr(Sample, "actual_q")
    assert "actual_q" in sample_fields.SampleFields.__annotations__


if __name__ == "__main__":
    head = PATH.read_text().partition(MARK)[0]
    PATH.write_text(head + MARK + lines())

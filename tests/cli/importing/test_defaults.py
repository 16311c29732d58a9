"""What imports make of what nobody said."""

from __future__ import annotations

import pytest

from gatewayd.cli.importing.defaults import cell_name, listen_address


@pytest.mark.parametrize(
    "file, name",
    [("a/Press 3.csv", "press-3"), ("record_configuration.xml", "record-configuration"), ("___", "robot")],
)
def test_the_cell_is_called_as_the_file(file: str, name: str) -> None:
    assert cell_name(file) == name


def test_a_long_name_is_cut() -> None:
    assert len(cell_name("x" * 100)) == 64


@pytest.mark.parametrize(
    "writers, listen",
    [
        ([], "127.0.0.1:502"),
        (["127.0.0.1", "127.0.0.0/8"], "127.0.0.1:502"),
        (["127.0.0.1", "192.0.2.20"], "0.0.0.0:502"),
        (["here"], "0.0.0.0:502"),
    ],
)
def test_nobody_reaches_a_gateway_that_only_this_machine_uses(writers: list[str], listen: str) -> None:
    assert listen_address(writers) == listen

"""From what the command line names to plans: everything that can be served is, everything else is told."""

from __future__ import annotations

import logging
from dataclasses import replace
from pathlib import Path

import pytest

from gatewayd.mapping.worker import compile_files
from gatewayd.service import startup
from gatewayd.service.startup import load_plans, mapping_files, misnamed

GOOD = """\
gatewayd: 1
cell: {name}
robot: {{host: 127.0.0.1, port: {port}}}
modbus: {{listen: '127.0.0.1:1502', unit: {unit}}}
writers: {{plc: {{modbus: 127.0.0.2}}}}
variables:
  x: {{robot: input_int_register_0, modbus: 0}}
"""


def write(path: Path, unit: int = 1, name: str = "") -> Path:
    path.write_text(GOOD.format(name=name or path.stem, unit=unit, port=30000 + unit))
    return path


def texts(caplog: pytest.LogCaptureFixture) -> list[str]:
    return [record.getMessage() for record in caplog.records]


def field(record: logging.LogRecord, name: str) -> object:
    return record.__dict__["fields"][name]


def test_a_directory_stands_for_its_mappings_by_name(tmp_path: Path) -> None:
    for name in ("b.yaml", "a.yaml", "notes.txt", ".hidden", "c.yaml.bak"):
        (tmp_path / name).touch()
    assert mapping_files([tmp_path]) == [tmp_path / "a.yaml", tmp_path / "b.yaml"]
    assert mapping_files([tmp_path / "c.yaml.bak", tmp_path]) == [
        tmp_path / "c.yaml.bak",
        tmp_path / "a.yaml",
        tmp_path / "b.yaml",
    ]


def test_an_empty_directory_is_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    assert mapping_files([tmp_path]) == []
    assert texts(caplog) == ["no mapping file in the directory"]


def test_good_files_are_served_beside_all_others(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    broken = tmp_path / "broken.yaml"
    broken.write_text("gatewayd: 1\ncell: broken\n")
    missing = tmp_path / "missing.yaml"
    found = load_plans([write(tmp_path / "one.yaml"), missing, broken, write(tmp_path / "two.yaml", 2)])
    assert [plan.cell.name for plan in found.plans] == ["one", "two"]
    assert (found.unreadable, found.broken) == (1, 1)
    (unread,) = (record for record in caplog.records if record.getMessage() == "cannot read the mapping file")
    assert (field(unread, "file"), field(unread, "reason")) == (str(missing), "No such file or directory")
    (unserved,) = (record for record in caplog.records if record.getMessage() == "the cell is not served")
    assert field(unserved, "remedy") == f"gatewayd check {broken}"


def test_findings_name_place_rule_and_remedy(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    path = write(tmp_path / "cell.yaml")
    path.write_text(path.read_text().replace("input_int_register_0", "input_int_registre_0"))
    assert load_plans([path]).plans == ()
    first = next(record for record in caplog.records if record.levelno == logging.ERROR)
    assert str(field(first, "at")).startswith(f"{path}:7:")
    assert str(field(first, "rule")).startswith("GW")
    assert "input_int_register_0" in f"{first.getMessage()} {field(first, 'hint')}"


def test_files_that_clash_with_each_other(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Two cells of one unit id behind one listener: the first is served, the second is told."""
    found = load_plans([write(tmp_path / "one.yaml", 1), write(tmp_path / "two.yaml", 1)])
    assert len(found.plans) == 1
    assert found.broken == 1
    assert "the cell is not served" in texts(caplog)


@pytest.mark.parametrize("name", ["x" * 300 + ".yaml", "a/b/c.yaml", "\udcff.yaml"])
def test_names_that_no_file_can_have(tmp_path: Path, caplog: pytest.LogCaptureFixture, name: str) -> None:
    found = load_plans([tmp_path / name])
    assert (found.plans, found.unreadable) == ((), 1)
    assert texts(caplog) == ["cannot read the mapping file"]


def test_a_loop_of_links(tmp_path: Path) -> None:
    (tmp_path / "loop.yaml").symlink_to(tmp_path / "loop.yaml")
    assert load_plans([tmp_path / "loop.yaml"]).unreadable == 1


def test_a_directory_named_like_a_mapping(tmp_path: Path) -> None:
    (tmp_path / "cells" / "trap.yaml").mkdir(parents=True)
    write(tmp_path / "cells" / "good.yaml")
    found = load_plans([tmp_path / "cells"])
    assert (len(found.plans), found.unreadable) == (1, 1)


def test_a_link_has_no_name_that_the_status_has_for_something_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """No section has such a name; the instances of a kind will have names of their own."""
    plan = compile_files([str(write(tmp_path / "one.yaml"))]).plans[0]
    for name, wrong in (("writers", True), ("quality", True), ("lines", False)):
        renamed = replace(plan, links={**plan.links, name: plan.links["modbus"]})
        assert bool(list(misnamed([renamed]))) is wrong
    monkeypatch.setattr(startup, "misnamed", lambda plans: ((each.source, "why") for each in plans))
    found = load_plans([tmp_path])
    assert (found.plans, found.broken) == ((), 1)
    assert "cannot serve the cell" in texts(caplog)

"""Places of the program and of the data sheet, as python-canopen reads that: a master's configurator sees the same."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import canopen

from gatewayd.links.canopen_node.exports import EXPORTS
from gatewayd.links.exports import Export
from tests.plc_golden import CANOPEN_MAPPING, canopen_model, plan_from


def test_a_master_that_reads_the_data_sheet_sees_the_same_places(tmp_path: Path) -> None:
    found = canopen_model()
    sheet = next(export for export in EXPORTS if export.name == "eds")
    assert isinstance(sheet, Export)
    path = tmp_path / "line-2.eds"
    path.write_text(sheet.make(plan_from(CANOPEN_MAPPING)))
    node: Any = canopen.Network().add_node(canopen.RemoteNode(found.node, str(path)))
    node.tpdo.read(from_od=True)
    node.rpdo.read(from_od=True)
    for pdo in found.pdos:
        its = (node.tpdo if pdo.transmits else node.rpdo)[int(pdo.name[4:])]
        assert its.cob_id == pdo.cob_id
        places = [(each.offset, each.index, each.subindex) for each in its.map]
        assert places == [(entry.start, entry.index, entry.subindex) for entry in pdo.entries], pdo.name

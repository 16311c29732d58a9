"""PLC programs as their golden files have them: `python -m tests.plc_golden` writes these anew.

No tool of a vendor can run here. What a foreign reader can judge, tests let it judge; the rest is looked at by people
when it changes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from gatewayd.links.canopen_node.plc import build as canopen_build
from gatewayd.links.canopen_node.plc import registry as canopen_registry
from gatewayd.links.canopen_node.plc.model import PdoModel
from gatewayd.links.modbus_server.plc.build import model_of
from gatewayd.links.modbus_server.plc.model import PlcModel
from gatewayd.links.modbus_server.plc.registry import files_for
from gatewayd.mapping.loader import load
from gatewayd.mapping.plan import Plan
from gatewayd.plc.export import TARGETS
from gatewayd.plc.tags import PlcWishes
from tests.sources import ROOT

GOLDEN = ROOT / "tests" / "golden" / "plc"
MAPPING = GOLDEN / "press-3.yaml"
CANOPEN_GOLDEN = ROOT / "tests" / "golden" / "plc-canopen"
CANOPEN_MAPPING = CANOPEN_GOLDEN / "line-2.yaml"
MASTERS = tuple(target for target in TARGETS if target not in canopen_registry.REFUSED)
"""Targets whose controllers can be a CANopen master."""


def plan_from(path: Path) -> Plan:
    """The plan of a mapping file without errors."""
    loaded = load(path.read_bytes(), path.name)
    assert loaded.plan is not None, loaded.diagnostics
    return loaded.plan


def golden_model(handshake: str | None = None) -> PlcModel:
    """The cell of the golden files, for its PLC on Modbus; with a self test where there is a handshake."""
    return model_of(plan_from(MAPPING), PlcWishes(writer="plc", handshake=handshake))


def model_for(target: str) -> PlcModel:
    """The same, with a self test where the target has one."""
    return golden_model(None if target in ("c", "studio5000") else "toggle:ack")


def canopen_model() -> PdoModel:
    """The cell of the golden files for a CANopen master."""
    return canopen_build.model_of(plan_from(CANOPEN_MAPPING), PlcWishes())


def made() -> Mapping[Path, bytes]:
    """Where each golden file for a PLC on Modbus lies, and what it has to be."""
    return dict(_made())


def made_for_canopen() -> Mapping[Path, bytes]:
    """Where each golden file for a CANopen master lies, and what it has to be."""
    model = canopen_model()
    return {
        CANOPEN_GOLDEN / target / file.name: file.content()
        for target in MASTERS
        for file in canopen_registry.files_for(target, model)
    }


def _made() -> Iterator[tuple[Path, bytes]]:
    for target in TARGETS:
        for file in files_for(target, model_for(target)):
            yield GOLDEN / target / file.name, file.content()


def main() -> None:
    """Write them."""
    for path, content in {**made(), **made_for_canopen()}.items():
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content)


if __name__ == "__main__":
    main()

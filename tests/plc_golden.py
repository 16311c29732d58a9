"""PLC programs as their golden files have them: `python -m tests.plc_golden` writes these anew.

No tool of a vendor can run here. What a foreign reader can judge, tests let it judge; the rest is looked at by people
when it changes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from gatewayd.links.modbus_server.plc.build import model_of
from gatewayd.links.modbus_server.plc.model import PlcModel
from gatewayd.links.modbus_server.plc.registry import files_for
from gatewayd.mapping.loader import load
from gatewayd.plc.export import TARGETS
from gatewayd.plc.tags import PlcWishes
from tests.sources import ROOT

GOLDEN = ROOT / "tests" / "golden" / "plc"
MAPPING = GOLDEN / "press-3.yaml"


def golden_model() -> PlcModel:
    """The cell of the golden files, for its PLC."""
    loaded = load(MAPPING.read_bytes(), MAPPING.name)
    assert loaded.plan is not None, loaded.diagnostics
    return model_of(loaded.plan, PlcWishes(writer="plc"))


def made() -> Mapping[Path, bytes]:
    """Where each golden file lies, and what it has to be."""
    return dict(_made(golden_model()))


def _made(model: PlcModel) -> Iterator[tuple[Path, bytes]]:
    for target in TARGETS:
        for file in files_for(target, model):
            yield GOLDEN / target / file.name, file.content()


def main() -> None:
    """Write them."""
    for path, content in made().items():
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content)


if __name__ == "__main__":
    main()

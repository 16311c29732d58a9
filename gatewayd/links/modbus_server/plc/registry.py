"""The targets of `plc.export.TARGETS`, each with a module."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib import import_module
from typing import Final, cast

from gatewayd.links.exports import ExportedFile, ExportError
from gatewayd.links.modbus_server.plc.model import PlcModel
from gatewayd.plc.names import Holds, refuse_unfit

_WITHOUT_SELF_TEST: Final = frozenset({"c", "studio5000"})


@dataclass(frozen=True, slots=True)
class PlcTool:
    """One tool: what it can hold, and what writes its files."""

    holds: Holds
    files: Callable[[PlcModel], Iterable[ExportedFile]]


def target_named(name: str) -> PlcTool:
    """The target, imported to use it."""
    module = import_module(f"gatewayd.links.modbus_server.plc.targets.{name.replace('-', '_')}")
    return PlcTool(cast("Holds", module.HOLDS), module.files)


def files_for(name: str, model: PlcModel, *, small: bool = False) -> tuple[ExportedFile, ...]:
    """All files of a target. Raises ExportError for what it cannot hold."""
    target = target_named(name)
    if model.self_test is not None and name in _WITHOUT_SELF_TEST:
        raise ExportError(
            f"--handshake: the self test is there as structured text only, and `{name}` has none: "
            "leave --handshake out, and program its steps by the comment in the robot program"
        )
    refuse_unfit(model, target.holds, small=small)
    return tuple(target.files(model))

"""The files for the engineering tool of a PLC that reaches the gateway by Modbus."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from gatewayd.links.exports import ExportedFile
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.links.modbus_server.plc.build import model_of
from gatewayd.links.modbus_server.plc.registry import files_for
from gatewayd.mapping.plan import Plan
from gatewayd.plc.export import plc_export
from gatewayd.plc.tags import PlcWishes


def _files(plan: Plan, wishes: PlcWishes, target: str, small: bool) -> Iterable[ExportedFile]:
    return files_for(target, model_of(plan, wishes), small=small)


EXPORTS: Final = (plc_export("modbus", lambda plan: bool(plan.of(ModbusPlan)), _files),)

"""Rule GW236: the files of a listener with TLS, where they are at hand.

A mapping is checked on other machines than that of the gateway, which have none of the files: then nothing is said.
Where some of them are there, this is the machine, and one that is missing is missing. No finding keeps a cell from
starting: what else it has, it can serve.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator

from gatewayd.links.modbus_server.plan import TrustFiles
from gatewayd.links.modbus_server.sections import Modbus
from gatewayd.mapping.diagnostics import Diagnostic, Rule, Severity
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules.registry import cell_rule


@cell_rule("GW236", Severity.WARNING)
def certificate_files(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Certificates, keys or lists that cannot be used, or not for long."""
    modbus = cell.document.part(Modbus)
    if modbus is None or modbus.spec.tls is None:
        return
    tls = modbus.spec.tls
    files = TrustFiles(tls.certificate, tls.key, tls.clients, tls.revoked)
    from gatewayd.links.modbus_server.trust import paths_of  # noqa: PLC0415 - where a mapping has TLS
    from gatewayd.links.modbus_server.trust_findings import findings  # noqa: PLC0415

    paths = paths_of(files)
    if not any(map(os.path.exists, paths.values())):
        return
    for found in findings(files, time.time()):
        yield rule.at(modbus.at("tls", found.key), f"{paths[found.key]} {found.text}", hint=found.remedy)

"""What a gateway says of a cell with two links of the new kind, as JSON. Copied into a tree that has the kind."""

from __future__ import annotations

import asyncio
import json
import sys
from dataclasses import replace
from pathlib import Path

from gatewayd.links.udp_lines.plan import LinesPlan  # type: ignore[import-not-found]

from gatewayd.control.views import cell_view, declare
from gatewayd.loop import clock
from gatewayd.mapping.plan import Plan
from gatewayd.mapping.worker import compile_files
from gatewayd.report.diff import as_text, compare
from gatewayd.service.daemon import Daemon
from gatewayd.service.objections import objections_of_change
from gatewayd.web.metrics import Exposition
from gatewayd.web.probes import Probes
from gatewayd.web.view import layout
from tests.works import finished


def looks(daemon: Daemon) -> dict[str, object]:
    """The cell in every place where links are shown."""
    (runtime,) = daemon.runtimes
    declared = declare(runtime.plan)
    page = layout(runtime)
    variable = page["variables"][0]  # type: ignore[index]
    metrics = finished(Exposition(Probes(daemon), "").text()).decode().splitlines()
    return {
        "status": cell_view(runtime, declared, clock.now()),
        "variable": declared.variables[0],
        "page": {name: page[name] for name in ("lines", "left", "right")},
        "places": [(place["link"], place["address"]) for place in variable["places"]],
        "metrics": [line for line in metrics if line.startswith("gatewayd_lines_total{")],
        "progress": daemon.progress(),
        "ids": {name: id(link) for name, link in runtime.links.items()},
    }


async def main(file: str, directory: Path, listen: int, to: int) -> dict[str, object]:
    """Serve both, then move the right one, whose lines go elsewhere and whose socket is another one."""
    (found,) = compile_files([file]).plans
    lines = found.of(LinesPlan)["lines"]
    plans = {name: link for name, link in found.links.items() if name != "lines"}
    right = replace(lines, listen=(lines.listen[0], listen), period=2 * lines.period)
    old = Plan(found.source, found.cell, {**plans, "left": lines, "right": right})
    new = old.with_links(right=replace(right, listen=(lines.listen[0], to), to=(lines.listen[0], listen)))
    daemon, stop = Daemon([old], directory), asyncio.Event()
    running = asyncio.create_task(daemon.run(stop))
    await asyncio.sleep(3 * right.period)
    before = looks(daemon)
    changes = compare(old, new)
    objected = [each.text for each in objections_of_change(daemon.runtimes[0], changes)]
    daemon.swap([new], clock.now(), await daemon.shared.prepare([new]))
    after = looks(daemon)
    stop.set()
    await running
    return {
        "before": before,
        "after": after,
        "diff": as_text(changes),
        "objections": objected,
    }


print(json.dumps(asyncio.run(main(sys.argv[1], Path(sys.argv[2]), *map(int, sys.argv[3:])))))

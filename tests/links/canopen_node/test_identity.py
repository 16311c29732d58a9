"""The identity of a node, as a reload compares it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from gatewayd.links.canopen_node.identity import identity_of
from gatewayd.links.canopen_node.plan import canopen_of
from gatewayd.mapping.loader import load

MAPPING = Path(__file__).parents[3] / "mappings" / "canopen-only.yaml"


def test_it_is_that_of_the_running_node() -> None:
    plan = load(MAPPING.read_bytes(), "cell.yaml").plan
    assert plan is not None
    node = canopen_of(plan)
    assert node is not None
    assert identity_of(node, plan.cell) == identity_of(node, plan.cell)
    assert identity_of(node, plan.cell).product != 0


def test_a_daemon_that_asks_for_it_loads_nothing_of_the_mapping_language() -> None:
    """It would cost 14 MB, and the loop a tenth of a second, at the first reload."""
    script = (
        "import sys; import gatewayd.links.canopen_node.identity, gatewayd.links.canopen_node.declaration; "
        "sys.exit(' '.join({'gatewayd.mapping.tables', 'ruamel.yaml'} & set(sys.modules)) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")

"""Which driver a bus gets."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from gatewayd.canopen.drivers import make_bus
from gatewayd.canopen.pythoncan import PythonCanBus
from gatewayd.canopen.socketcan import SocketCanBus
from tests.links.canopen_node.recorder import Recorder


def test_socketcan_has_a_path_of_its_own_and_the_rest_goes_through_python_can() -> None:
    assert isinstance(make_bus("socketcan", "can0", 500_000, Recorder()), SocketCanBus)
    assert isinstance(make_bus("virtual", "press", 500_000, Recorder()), PythonCanBus)


def test_python_can_is_not_imported_for_socketcan() -> None:
    """It would take a fifth of a second of the start."""
    program = "import sys, gatewayd.canopen.drivers; sys.exit('can' in sys.modules)"
    root = Path(__file__).parents[2]
    assert subprocess.run([sys.executable, "-c", program], check=False, cwd=root).returncode == 0

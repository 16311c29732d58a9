"""Every command of docs/howto/secure-modbus.md, in its order; and what they make is good for a listener."""

from __future__ import annotations

import re
import shutil
import subprocess
import time
from pathlib import Path

import pytest

from gatewayd.links.modbus_server.plan import TrustFiles
from gatewayd.links.modbus_server.role import role_of
from gatewayd.links.modbus_server.trust import load
from gatewayd.links.modbus_server.trust_findings import findings
from gatewayd.machine.x509 import from_pem
from tests.sources import ROOT

PAGE = (ROOT / "docs" / "howto" / "secure-modbus.md").read_text()
COMMANDS = re.findall(r"^```sh\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)


@pytest.mark.skipif(shutil.which("openssl") is None, reason="no program openssl")
def test_the_recipe(tmp_path: Path) -> None:
    etc = tmp_path / "etc"
    output = ""
    for number, commands in enumerate(COMMANDS):
        # Another folder than the system's, and no group that only the package makes. A shell for each, as in practice.
        script = commands.replace("/etc/gatewayd", str(etc)).replace(" -g gatewayd", "")
        where = tmp_path / "commissioning" if number else tmp_path
        bash = ["bash", "-euo", "pipefail", "-c", script]
        done = subprocess.run(bash, cwd=where, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        output += done.stdout
    assert "subject=CN = plc-press-3" in output
    assert "..Operator" in output
    tls = etc / "tls"
    names = ("cell.crt", "cell.key", "clients.crt", "revoked.crl")
    files = TrustFiles(*(str(tls / name) for name in names))
    assert list(findings(files, time.time())) == []
    (client,) = from_pem((tmp_path / "commissioning" / "plc.crt").read_bytes())
    assert role_of(client) == "Operator"
    assert load(files, time.time()).facts.revoked == {(client.issuer_name, client.serial)}

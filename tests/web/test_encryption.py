from __future__ import annotations

import ssl
from pathlib import Path

import pytest

from gatewayd.web.encryption import handshake_cost, server_context
from tests.machine.authority import OPENSSL, Authority


def test_nothing_older_than_tls_1_2_and_no_renegotiation() -> None:
    context = server_context()
    assert context.minimum_version is ssl.TLSVersion.TLSv1_2
    assert context.options & ssl.OP_NO_RENEGOTIATION


@pytest.mark.skipif(OPENSSL is None, reason="openssl is not installed")
def test_a_handshake_is_measured(tmp_path: Path) -> None:
    context = server_context()
    context.load_cert_chain(*Authority(tmp_path).issue("gateway"))
    assert 0.00001 < handshake_cost(context) < 0.5

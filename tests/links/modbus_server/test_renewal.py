"""Files that are read again: good ones are used, bad ones change nothing and are reported."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from gatewayd.core.cell import Cell
from gatewayd.links.modbus_server.listener import ListenError, ModbusListener
from gatewayd.links.modbus_server.plan import ModbusPlan, TrustFiles
from gatewayd.links.modbus_server.renewal import make_ready, renew_changed
from tests.links.modbus_server.secured import READ, Certificates, client_context, dialled, listening, secured
from tests.peers.authority import OPENSSL, Issued

pytestmark = pytest.mark.skipif(OPENSSL is None, reason="no program openssl")


@pytest.fixture
def files(certificates: Certificates, tmp_path: Path) -> TrustFiles:
    """Copies, which a test may change."""
    copies = {name: tmp_path / name for name in ("certificate", "key", "clients", "revoked")}
    found = certificates.files()
    for name, copy in copies.items():
        put(copy, Path(getattr(found, name)).read_bytes())
    return TrustFiles(**{name: str(path) for name, path in copies.items()})


@pytest.fixture
def plan(files: TrustFiles, plan_of: Callable[..., ModbusPlan], index_of: Callable[[str], int]) -> ModbusPlan:
    return secured(plan_of(), files, index_of)


def put(path: Path, content: bytes) -> None:
    """Whole or not at all, as the how-to does it."""
    new = path.with_suffix(".new")
    new.write_bytes(content)
    new.chmod(0o640)
    new.replace(path)


def install(files: TrustFiles, issued: Issued) -> None:
    put(Path(files.key), issued.key.read_bytes())
    put(Path(files.certificate), issued.certificate.read_bytes())


async def test_a_renewed_certificate_is_shown_and_nobody_is_dropped(
    certificates: Certificates,
    files: TrustFiles,
    plan: ModbusPlan,
    live_cell: Cell,
) -> None:
    context = client_context(certificates, certificates.operator)
    async with listening(plan, live_cell) as listener, dialled(listener, context) as before:
        assert await before.ask(READ)
        assert await renew_changed([listener]) == []
        first = listener.trust
        install(files, certificates.authority.issue("renewed", key="ec"))
        assert await renew_changed([listener]) == []
        assert listener.trust is not first
        assert await before.ask(READ), "it stays"
        async with dialled(listener, context) as after:
            shown = after.tls.getpeercert()
            assert shown is not None
            assert shown["subject"] == ((("commonName", "renewed"),),)


async def test_bad_files_change_nothing_and_are_a_problem_until_they_are_good(
    certificates: Certificates,
    files: TrustFiles,
    plan: ModbusPlan,
    live_cell: Cell,
    caplog: pytest.LogCaptureFixture,
) -> None:
    context = client_context(certificates, certificates.operator)
    async with listening(plan, live_cell) as listener:
        put(Path(files.key), certificates.viewer.key.read_bytes())
        for _ in range(2):
            (problem,) = await renew_changed([listener])
            assert "does not fit the certificate" in problem
            assert problem.endswith("has read before stay in use")
        assert [record.message for record in caplog.records].count("certificates cannot be renewed") == 1
        async with dialled(listener, context) as client:
            assert await client.ask(READ)
        put(Path(files.key), certificates.gateway.key.read_bytes())
        assert await renew_changed([listener]) == []
        assert listener.problem == ""


async def test_a_listener_without_its_files_does_not_open_and_says_why(certificates: Certificates) -> None:
    files = TrustFiles("/nowhere/cell.crt", str(certificates.gateway.key), "/nowhere/clients.crt", None)
    listener = ModbusListener("127.0.0.1", 0, files=files)
    with pytest.raises(
        ListenError, match=r"cannot listen on 127.0.0.1:0: modbus: tls: certificate: /nowhere"
    ):
        await make_ready(listener)
    await make_ready(ModbusListener("127.0.0.1", 0))

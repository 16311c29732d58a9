"""`modbus: tls:` as it is written."""

from __future__ import annotations

import pytest

from gatewayd.links.modbus_server.tls_sections import Tls
from gatewayd.mapping.typed import Invalid

FILES = {"certificate": "/c.crt", "key": "/c.key", "clients": "/a.crt"}


@pytest.mark.parametrize(
    "written,meant",
    [
        ("192.0.2.2", "192.0.2.2:802"),
        ("192.0.2.2:1802", "192.0.2.2:1802"),
        ("::1", "[::1]:802"),
        ("[::1]", "[::1]:802"),
        ("[::1]:803", "[::1]:803"),
    ],
)
def test_the_port_is_802_where_none_is_written(written: str, meant: str) -> None:
    assert str(Tls.model_validate({**FILES, "listen": written}).listen) == meant


def test_what_is_not_written() -> None:
    tls = Tls.model_validate(FILES)
    assert (str(tls.listen), tls.revoked, tls.roles, tls.without_role) == ("127.0.0.1:802", None, {}, None)


@pytest.mark.parametrize(
    "wrong",
    [
        {"listen": "gateway:802"},
        {"listen": 802},
        {"key": "cell.key"},
        {"key": ""},
        {"roles": {"": {}}},
        {"roles": {"x" * 65: {}}},
        {"roles": {"a\nb": {}}},
        {"roles": {"operator": {"reed": "all"}}},
        {"roles": {"operator": {"read": "1st"}}},
        {"certificate": None},
    ],
)
def test_what_cannot_be_meant(wrong: dict[str, object]) -> None:
    with pytest.raises(Invalid):
        Tls.model_validate({**FILES, **wrong})

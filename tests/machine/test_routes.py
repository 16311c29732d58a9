"""Questions to the kernel and its answers: made by hand, and of this machine's own kernel."""

from __future__ import annotations

import errno
import ipaddress
import socket
import struct
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.machine import routes
from gatewayd.machine.routes import Route, has_link, parse, route_to


def attribute(kind: int, data: bytes) -> bytes:
    return struct.pack("=HH", len(data) + 4, kind) + data + bytes(-len(data) % 4)


def answer(*attributes: bytes, kind: int = 1) -> bytes:
    body = struct.pack("=8BI", 2, 32, 0, 0, 254, 0, 0, kind, 0) + b"".join(attributes)
    return struct.pack("=IHHII", 16 + len(body), 24, 0, 1, 0) + body


def test_a_route_has_interface_source_and_router() -> None:
    loopback = socket.if_nametoindex("lo")
    found = parse(
        answer(
            attribute(4, struct.pack("=I", loopback)),
            attribute(5, ipaddress.ip_address("192.0.2.1").packed),
            attribute(7, ipaddress.ip_address("192.0.2.7").packed),
        )
    )
    assert found == Route("lo", "192.0.2.7", "192.0.2.1")


def test_a_refusal_has_the_kernels_reason() -> None:
    with pytest.raises(OSError) as refused:
        parse(struct.pack("=IHHIIi", 36, 2, 0, 1, 0, -errno.ENETUNREACH))
    assert refused.value.errno == errno.ENETUNREACH


@given(st.binary(max_size=200) | st.binary(max_size=60).map(answer))
def test_whatever_comes_it_is_a_route_or_an_oserror(reply: bytes) -> None:
    try:
        parse(reply)
    except OSError:
        return


def test_the_kernel_of_this_machine_answers() -> None:
    found = route_to("127.0.0.1")
    assert (found.interface, found.is_local, found.has_link) == ("lo", True, True)


def test_link_is_what_the_kernel_says_of_the_carrier(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(routes, "_INTERFACES", tmp_path)
    for name, text in (("plugged", "1\n"), ("empty", "0\n")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "carrier").write_text(text)
    (tmp_path / "down").mkdir()
    (tmp_path / "down" / "carrier").mkdir()  # reading it fails, as it does of an interface that is down
    assert [has_link(name) for name in ("plugged", "empty", "down", "unknown")] == [True, False, False, True]

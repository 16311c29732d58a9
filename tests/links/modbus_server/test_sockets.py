from __future__ import annotations

import socket
import time

from gatewayd.links.modbus_server.sockets import has_unread, seconds_since_established, set_options


def test_what_the_kernel_knows_of_a_connection_that_waited() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        begin = time.monotonic()
        with socket.create_connection(listening.getsockname()) as peer:
            time.sleep(0.1)
            with listening.accept()[0] as ours:
                age, most = seconds_since_established(ours), time.monotonic() - begin
                assert 0.08 < age < most + 0.02
                assert not has_unread(ours.fileno())
                peer.send(b"a")
                assert ours.recv(1, socket.MSG_PEEK) == b"a"
                assert has_unread(ours.fileno())


def test_a_socket_that_has_ended_has_nothing() -> None:
    ours, theirs = socket.socketpair()
    descriptor = ours.fileno()
    ours.close()
    theirs.close()
    assert not has_unread(descriptor)
    assert seconds_since_established(ours) == 0.0
    set_options(ours)

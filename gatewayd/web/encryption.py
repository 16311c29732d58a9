"""TLS for the status listener: which versions, and what a handshake costs the loop."""

from __future__ import annotations

import ssl
from contextlib import suppress
from time import perf_counter

HANDSHAKE_TIME = 5.0
"""Seconds for a handshake, the client's part included."""
USUAL_COST = 0.002
"""Seconds that a handshake is taken to cost until it was measured: about that of a 2048-bit RSA key."""
_MOST_STEPS = 20


def server_context() -> ssl.SSLContext:
    """TLS 1.2 and later with OpenSSL's own choice of ciphers, HTTP/1.1, and no renegotiation."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    context.options |= ssl.OP_NO_RENEGOTIATION
    context.set_alpn_protocols(["http/1.1"])
    return context


def handshake_cost(context: ssl.SSLContext) -> float:
    """Seconds that the server's side of a handshake takes here, measured in memory: by the key, 0.2 to 10 ms.

    The first one sets OpenSSL up and is slower, so the lesser of two counts. Call it in a thread.
    """
    return min(_one_handshake(context), _one_handshake(context))


def _one_handshake(context: ssl.SSLContext) -> float:
    to_server, to_client = ssl.MemoryBIO(), ssl.MemoryBIO()
    client_context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    client_context.check_hostname = False
    client_context.verify_mode = ssl.CERT_NONE
    server = context.wrap_bio(to_server, to_client, server_side=True)
    client = client_context.wrap_bio(to_client, to_server)
    spent = 0.0
    for _ in range(_MOST_STEPS):
        with suppress(ssl.SSLWantReadError):
            client.do_handshake()
        begun = perf_counter()
        try:
            server.do_handshake()
        except ssl.SSLWantReadError:
            spent += perf_counter() - begun
            continue
        return spent + perf_counter() - begun
    return USUAL_COST

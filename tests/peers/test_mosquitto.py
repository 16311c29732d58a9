"""The broker of the tests does what its options say."""

from __future__ import annotations

import ssl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from tests.e2e.processes import wait_for
from tests.peers.mosquitto import BrokerOptions, Mosquitto, certificates, mosquitto

paho = pytest.importorskip("paho.mqtt.client")
USERS = {"gatewayd": "secret", "host": "other"}
ACCESS = "user gatewayd\ntopic write values/#\nuser host\ntopic readwrite #\n"


@contextmanager
def client(broker: Mosquitto, user: str = "", **tls: Path) -> Iterator[Any]:
    """A connected client; `received` has the messages, `answer` what the broker said to the connection."""
    one = paho.Client(paho.CallbackAPIVersion.VERSION2)
    one.received, one.answer = [], None

    def accepted(_client: object, _data: object, _flags: object, reason: Any, _properties: object) -> None:
        one.answer = str(reason)

    def ended(_client: object, _data: object, _flags: object, reason: Any, _properties: object) -> None:
        one.answer = one.answer or f"ended: {reason}"

    one.on_connect = accepted
    one.on_disconnect = ended
    one.on_message = lambda _client, _data, message: one.received.append(
        (message.topic, message.payload, message.retain)
    )
    if user:
        one.username_pw_set(user, USERS.get(user, "wrong"))
    if tls:
        one.tls_set(**tls)
    one.connect(broker.host, broker.port)
    one.loop_start()
    try:
        wait_for(lambda: one.answer is not None, "an answer of the broker")
        yield one
    finally:
        one.disconnect()
        one.loop_stop()


def test_passwords_and_access(tmp_path: Path) -> None:
    with mosquitto(tmp_path, BrokerOptions(users=USERS, access=ACCESS)) as broker:
        with client(broker, "stranger") as refused:
            assert refused.answer == "Not authorized"
        with client(broker, "host") as host, client(broker, "gatewayd") as writer:
            host.subscribe("#")
            broker.wait_for_line("Sending SUBACK")
            writer.publish("other", b"1")
            writer.publish("values/a", b"2")
            wait_for(lambda: host.received != [], "a message")
            assert host.received == [("values/a", b"2", False)]


@pytest.mark.slow
def test_retained_messages_survive_a_restart_where_they_are_to(tmp_path: Path) -> None:
    with mosquitto(tmp_path, BrokerOptions(is_persistent=True)) as broker:
        with client(broker) as writer:
            writer.publish("a", b"1", qos=1, retain=True).wait_for_publish(5)
        broker.stop()
        broker.start()
        with client(broker) as reader:
            reader.subscribe("a")
            wait_for(lambda: reader.received == [("a", b"1", True)], "the retained message")


@pytest.mark.slow
def test_tls_with_certificates_of_both(tmp_path: Path) -> None:
    tls = certificates(tmp_path / "tls", asks_for_certificate=True)
    with mosquitto(tmp_path / "broker", BrokerOptions(tls=tls)) as broker:
        cert, key = tls.client_certificate, tls.client_key
        with client(broker, ca_certs=tls.authority, certfile=cert, keyfile=key) as one:
            assert one.answer == "Success"
        with client(broker, ca_certs=tls.authority) as refused:
            assert refused.answer.startswith("ended: ")
        with pytest.raises(ssl.SSLError), client(broker, ca_certs=cert):
            pytest.fail("trusted by a foreign authority")

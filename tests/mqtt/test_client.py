"""The client at mosquitto, and at peers that do it no good."""

from __future__ import annotations

import asyncio
import socket
import subprocess
import threading
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from pathlib import Path

import pytest

from gatewayd.mqtt import client as module
from gatewayd.mqtt.client import MqttClient
from gatewayd.mqtt.messages import MQTT_5, MQTT_311, BrokerSettings, BrokerTlsFiles, Message, Received
from gatewayd.mqtt.packets import Oversized
from tests.e2e.processes import HOST, PATIENCE, free_port
from tests.peers.mosquitto import BrokerOptions, Mosquitto, certificates, mosquitto

VERSIONS = pytest.mark.parametrize("version", [MQTT_311, MQTT_5])


class User:
    """Writes down what it gets to know."""

    def __init__(self) -> None:
        self.heard: list[Received] = []
        self.large: list[Oversized] = []
        self.answers: dict[str, str] = {}
        self.losses: list[str] = []
        self.connections = 0
        self.attempts = 0
        self.unread = 0

    async def preparing(self) -> None:
        self.attempts += 1

    def will(self) -> Message:
        return Message("a/available", b"offline", 0, retain=True)

    def connected(self) -> None:
        self.connections += 1

    def received(self, message: Received) -> None:
        self.heard.append(message)

    def oversized(self, message: Oversized) -> None:
        self.large.append(message)

    def flooded(self, count: int) -> None:
        self.unread += count

    def subscription(self, topics: Sequence[str], why: str) -> None:
        self.answers.update(dict.fromkeys(topics, why))

    def lost(self, reason: str, *, was_connected: bool) -> None:
        self.losses.append(reason)


async def until(condition: Callable[[], bool], what: str) -> None:
    async with asyncio.timeout(PATIENCE):
        while not condition():
            assert what
            await asyncio.sleep(0.005)


@asynccontextmanager
async def at_work(settings: BrokerSettings) -> AsyncIterator[tuple[MqttClient, User]]:
    user = User()
    client = MqttClient(settings, user, chance=lambda: 0.0)
    task = asyncio.create_task(client.run())
    try:
        yield client, user
    finally:
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task


def settings_of(broker: Mosquitto, version: int = MQTT_311, **more: object) -> BrokerSettings:
    return replace(BrokerSettings(HOST, broker.port, "press", version, 1), **more)  # type: ignore[arg-type]


@VERSIONS
async def test_messages_go_and_come(tmp_path: Path, version: int) -> None:
    with mosquitto(tmp_path / "broker") as broker:
        publish(broker, "a/kept", "old", "-r")
        async with at_work(settings_of(broker, version)) as (client, user):
            await until(lambda: client.is_connected, "a connection")
            client.subscribe(["a/#"])
            await until(lambda: user.answers == {"a/#": ""}, "a subscription")
            assert client.publish(Message("a/b", b"hi"))
            await until(lambda: len(user.heard) == 2, "both messages")
            assert set(user.heard) == {Received("a/kept", b"old", retained=True), Received("a/b", b"hi")}
            client.unsubscribe(["a/#"])
            assert not user.losses


@VERSIONS
async def test_a_huge_message_costs_neither_memory_nor_the_connection(tmp_path: Path, version: int) -> None:
    with mosquitto(tmp_path / "broker") as broker:
        async with at_work(settings_of(broker, version)) as (client, user):
            await until(lambda: client.is_connected, "a connection")
            client.subscribe(["a"])
            await until(lambda: "a" in user.answers, "a subscription")
            (tmp_path / "huge").write_bytes(b"x" * 3_000_000)
            run("mosquitto_pub", "-h", HOST, "-p", str(broker.port), "-t", "a", "-f", "huge", cwd=tmp_path)
            publish(broker, "a", "after")
            await until(lambda: user.heard == [Received("a", b"after")], "the next one")
            assert user.large == ([] if version == MQTT_5 else [Oversized("a", 3_000_003)])
            assert not user.losses


async def test_of_a_flood_no_more_is_read_than_can_be_served(tmp_path: Path) -> None:
    (tmp_path / "lines").write_text("x\n" * 3000)
    with mosquitto(tmp_path / "broker", BrokerOptions(more=("max_queued_messages 10000",))) as broker:
        async with at_work(settings_of(broker)) as (client, user):
            await until(lambda: client.is_connected, "a connection")
            client.subscribe(["a"])
            await until(lambda: "a" in user.answers, "a subscription")
            where = f"-h {HOST} -p {broker.port} -t a -l"
            run("sh", "-c", f"mosquitto_pub {where} < lines", cwd=tmp_path)
            await until(lambda: len(user.heard) + user.unread == 3000, "all of them")
            assert user.unread > 1000
            assert not user.losses


async def test_the_will_is_said_unless_the_client_leaves(tmp_path: Path) -> None:
    with mosquitto(tmp_path / "broker") as broker:
        async with at_work(settings_of(broker, client="watcher")) as (watcher, seen):
            await until(lambda: watcher.is_connected, "a connection")
            watcher.subscribe(["a/available"])
            await until(lambda: bool(seen.answers), "a subscription")
            async with at_work(settings_of(broker)) as (client, _user):
                await until(lambda: client.is_connected, "a connection")
                client.publish(Message("a/available", b"online", 0, retain=True))
            await until(lambda: len(seen.heard) == 2, "the will")
            async with at_work(settings_of(broker)) as (client, user):
                await until(lambda: client.is_connected, "a connection")
                await client.leave()
                assert not user.losses
                publish(broker, "a/available", "last")
            await until(lambda: len(seen.heard) == 3, "the last one")
            assert [message.payload for message in seen.heard] == [b"online", b"offline", b"last"]


async def test_it_comes_back_when_the_broker_does(tmp_path: Path) -> None:
    with mosquitto(tmp_path / "broker") as broker:
        async with at_work(settings_of(broker)) as (client, user):
            await until(lambda: client.is_connected, "a connection")
            broker.kill()
            await until(lambda: "Connection refused" in user.losses, "an attempt in vain")
            assert not client.publish(Message("a", b""))
            broker.start()
            await until(lambda: client.is_connected, "a connection")
            assert user.connections == 2


async def test_a_broker_that_stands_still_is_lost(tmp_path: Path) -> None:
    """Its kernel still takes what is sent: only the missing answer tells."""
    with mosquitto(tmp_path / "broker") as broker:
        async with at_work(settings_of(broker)) as (client, user):
            await until(lambda: client.is_connected, "a connection")
            broker.freeze()
            await until(lambda: bool(user.losses), "the loss")
            assert user.losses[0] == "the broker does not answer"
            broker.thaw()
            await until(lambda: client.is_connected, "a connection")


async def test_a_slow_broker_is_given_no_more_than_it_takes(tmp_path: Path) -> None:
    with mosquitto(tmp_path / "broker") as broker:
        async with at_work(settings_of(broker, keepalive=60)) as (client, _user):
            await until(lambda: client.is_connected, "a connection")
            broker.freeze()
            taken = 0
            while client.publish(Message("a", b"x" * 10_000)):
                taken += 1
                assert taken < 10_000, "without bound"
            assert not client.writable
            broker.thaw()
            await until(lambda: client.writable, "room")


async def test_a_wrong_password_is_said_and_tried_again_when_the_file_changes(tmp_path: Path) -> None:
    secret = tmp_path / "secret"
    secret.write_text("wrong\n")
    with mosquitto(tmp_path / "broker", BrokerOptions(users={"press": "right"})) as broker:
        settings = settings_of(broker, username="press", password_file=str(secret))
        async with at_work(settings) as (client, user):
            await until(lambda: bool(user.losses), "a refusal")
            assert user.losses[0] == "the broker refuses the connection: not authorized"
            secret.write_text("right\n")
            await until(lambda: client.is_connected, "a connection")
            secret.unlink()
            client.reconnect("test")
            await until(
                lambda: f"password_file {secret}: No such file or directory" in user.losses, "the file"
            )


async def test_a_broker_that_closes_at_once_is_lost_again_and_again_at_growing_pauses() -> None:
    attempts = 0

    def close(_reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        nonlocal attempts
        attempts += 1
        writer.close()

    port = free_port()
    server = await asyncio.start_server(close, HOST, port)
    async with server, at_work(BrokerSettings(HOST, port, "press")) as (_client, user):
        await until(lambda: len(user.losses) == 2, "losses")
        assert set(user.losses) <= {"the broker has closed the connection", "Connection reset by peer"}
    assert attempts == 2


async def test_a_peer_that_says_nothing_or_nonsense(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "CONNECT_WITHIN", 0.3)
    answers = [b"", b"HTTP/1.1 400 Bad Request\r\n\r\n", b"\x20\x02\x00\x01", b"\xff" * 10]

    async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.read(100)
        writer.write(answers.pop(0) if answers else b"")
        await reader.read()
        writer.close()

    port = free_port()
    server = await asyncio.start_server(answer, HOST, port)
    async with server, at_work(BrokerSettings(HOST, port, "press")) as (_client, user):
        await until(lambda: len(user.losses) >= 4, "losses")
    assert user.losses[0] == "no answer within 0.3 s"
    assert all(
        reason.startswith(("not MQTT", "no answer", "the broker refuses")) for reason in user.losses
    ), user.losses


async def test_threads_do_not_grow_with_attempts() -> None:
    before = threading.active_count()
    async with at_work(BrokerSettings("no-such-host.invalid", 1, "press")) as (_client, user):
        await until(lambda: len(user.losses) == 3, "losses")
        assert threading.active_count() <= before + 1


async def test_tls_with_a_certificate_and_with_a_foreign_one(tmp_path: Path) -> None:
    files = certificates(tmp_path / "files", asks_for_certificate=True)
    foreign = certificates(tmp_path / "foreign")
    with mosquitto(tmp_path / "broker", BrokerOptions(tls=files)) as broker:
        good = BrokerTlsFiles(str(files.authority), str(files.client_certificate), str(files.client_key))
        async with at_work(settings_of(broker, tls=good)) as (client, _user):
            await until(lambda: client.is_connected, "a connection by TLS")
        for tls, why in (
            (BrokerTlsFiles(str(foreign.authority)), "its certificate is not accepted: "),
            (BrokerTlsFiles(str(tmp_path / "none.pem")), "No such file"),
        ):
            async with at_work(settings_of(broker, tls=tls)) as (_client, user):
                await until(lambda: bool(user.losses), "a refusal")
                assert why in user.losses[0]
        async with at_work(settings_of(broker)) as (_client, user):
            await until(lambda: bool(user.losses), "a refusal of a plain connection")


def run(*words: str, cwd: Path) -> None:
    subprocess.run(words, check=True, capture_output=True, cwd=cwd)


def publish(broker: Mosquitto, topic: str, text: str, *options: str) -> None:
    """By mosquitto_pub."""
    command = ("mosquitto_pub", "-h", broker.host, "-p", str(broker.port), "-t", topic, "-m", text, *options)
    subprocess.run(command, check=True, capture_output=True)


async def test_what_passes_can_be_traced(tmp_path: Path) -> None:
    with mosquitto(tmp_path / "broker") as broker:
        passed: list[tuple[bytes, bool]] = []
        user = User()
        client = MqttClient(settings_of(broker), user)
        client.tap = lambda data, outgoing, _own: passed.append((data, outgoing))
        task = asyncio.create_task(client.run())
        await until(lambda: client.is_connected, "a connection")
        assert [(data[0] >> 4, outgoing) for data, outgoing in passed] == [(1, True), (2, False)]
        task.cancel()


@VERSIONS
async def test_another_client_with_the_same_identifier_is_named(tmp_path: Path, version: int) -> None:
    with mosquitto(tmp_path / "broker") as broker:
        async with at_work(settings_of(broker, version)) as (client, user):
            await until(lambda: client.is_connected, "a connection")
            async with at_work(settings_of(broker, version)) as (thief, _other):
                await until(lambda: thief.connections > 0, "the other one")
                await until(lambda: bool(user.losses), "the loss")
            assert "another client has come with the same" in user.losses[0]


async def test_neither_we_nor_the_kernel_keep_much_for_a_broker_that_reads_nothing() -> None:
    """It would get all of it later, and believe that it is new."""
    listener = socket.create_server((HOST, 0))
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)

    async def accept(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.read(100)
        writer.transport.pause_reading()  # type: ignore[attr-defined]
        writer.write(b"\x20\x02\x00\x00")
        await until(lambda: bool(full), "the end of the test")
        writer.transport.abort()

    full: list[int] = []
    async with (
        await asyncio.start_server(accept, sock=listener, limit=100),
        at_work(BrokerSettings(HOST, listener.getsockname()[1], "press")) as (client, _user),
    ):
        await until(lambda: client.is_connected, "a connection")
        taken = 0
        for _ in range(300):
            while client.publish(Message("a", bytes(1000))):
                taken += 1000
            await asyncio.sleep(0.001)
        full.append(taken)
    assert taken < 300_000

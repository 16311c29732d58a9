"""STATE messages: what counts, and hostile ones."""

from __future__ import annotations

import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.sparkplug.primary_host import HostState, PrimaryHost, decode_host_state
from gatewayd.sparkplug.wire import PayloadError


@pytest.mark.parametrize(
    "text, state",
    [
        ('{"online": true, "timestamp": 1700000000000}', HostState(True, 1_700_000_000_000)),
        ('{"timestamp":0,"online":false,"more":[{}]}', HostState(False, 0)),
        ('{"online": true, "timestamp": 1.7e12}', HostState(True, 1_700_000_000_000)),
    ],
)
def test_state_of_specification_3(text: str, state: HostState) -> None:
    assert decode_host_state(text.encode()) == state


@pytest.mark.parametrize(
    "data, words",
    [
        (b"", "not the JSON"),
        (b"ONLINE", "not the JSON of a STATE message"),
        (b"OFFLINE", "not the JSON"),
        (b"\xff\xfe", "not the JSON"),
        (b"[" * 1000, "not the JSON"),
        (b"[" * 1100, "at most 1024"),
        (b"true", "no `online`"),
        (b"[true, 5]", "no `online`"),
        (b'{"online": 1, "timestamp": 5}', "no `online`"),
        (b'{"online": "true", "timestamp": 5}', "no `online`"),
        (b'{"timestamp": 5}', "no `online`"),
        (b'{"online": true}', "no `timestamp`"),
        (b'{"online": true, "timestamp": true}', "no `timestamp`"),
        (b'{"online": true, "timestamp": "5"}', "no `timestamp`"),
        (b'{"online": true, "timestamp": -1}', "no `timestamp`"),
        (b'{"online": true, "timestamp": NaN}', "no `timestamp`"),
        (b'{"online": true, "timestamp": 1e400}', "no `timestamp`"),
        (b'{"online": true, "timestamp": 99999999999999999999}', "no `timestamp`"),
    ],
)
def test_other_states_are_refused_with_words(data: bytes, words: str) -> None:
    with pytest.raises(PayloadError, match=words):
        decode_host_state(data)


@given(st.binary(max_size=80) | st.text(max_size=40).map(str.encode))
def test_any_bytes_are_a_state_or_refused(data: bytes) -> None:
    with contextlib.suppress(PayloadError):
        decode_host_state(data)


def state(*, online: bool, timestamp: int) -> bytes:
    return f'{{"online": {str(online).lower()}, "timestamp": {timestamp}}}'.encode()


def test_a_refused_state_changes_nothing() -> None:
    host = PrimaryHost()
    assert host.receive(state(online=True, timestamp=5))
    for data in (state(online=False, timestamp=4), b"OFFLINE"):
        with pytest.raises(PayloadError):
            host.receive(data)
    assert host.is_online
    assert not host.receive(state(online=False, timestamp=5))


def test_a_session_knows_nothing_of_the_one_before() -> None:
    """The host's clock may have been set back meanwhile."""
    host = PrimaryHost()
    host.receive(state(online=True, timestamp=9))
    host.session_begins()
    assert not host.is_online
    assert host.receive(state(online=True, timestamp=3))

from __future__ import annotations

import pytest

from gatewayd import __version__
from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import Abort, AbortCode, Access, Dictionary, Entry, Pdo, record
from gatewayd.canopen.identity import (
    ErrorBehaviour,
    Identity,
    identity_objects,
    revision,
    revision_of,
)
from gatewayd.canopen.nmt import NmtCommand, NmtState
from gatewayd.canopen.product import PRODUCT_CODE, VENDOR_ID
from tests.links.canopen_node.wire import Client


@pytest.fixture
def dictionary() -> Dictionary:
    identity = Identity(VENDOR_ID, PRODUCT_CODE, revision(), 0xCAFE_F00D)
    return Dictionary(identity_objects(identity, "gatewayd press-3", lambda: 0x55))


def test_the_node_says_who_it_is(dictionary: Dictionary) -> None:
    client = Client(dictionary)
    assert client.read(0x1000) == 0
    assert client.read(0x1002) == 0x55
    assert [client.read(0x1018, number) for number in range(5)] == [
        4,
        VENDOR_ID,
        PRODUCT_CODE,
        revision(),
        0xCAFE_F00D,
    ]
    assert dictionary.read(0x1008, 0) == b"gatewayd press-3"
    assert dictionary.read(0x100A, 0) == __version__.encode()


def test_cct_sdo_03_writing_the_device_type_is_refused(dictionary: Dictionary) -> None:
    with pytest.raises(Abort) as caught:
        dictionary.write(0x1000, 0, bytes(4))
    assert caught.value.code is AbortCode.READ_ONLY


def test_revision_has_major_and_minor() -> None:
    assert revision("3.17.2") == revision("3.17rc1") == 0x0003_0011


def _revision(*, node: int = 5, volatile: bytes = b"\0\0", **changes: object) -> int:
    settings = {"name": "limit", "type": CanType.UNSIGNED16, "access": Access.RW, "default": b"\1\0"}
    limit = Entry(1, **{**settings, **changes})  # type: ignore[arg-type]
    follows = Entry(
        2, "COB-ID", CanType.UNSIGNED32, Access.RO, (0x180 + node).to_bytes(4, "little"), plus_node=True
    )
    shown = Entry(3, "shown", CanType.UNSIGNED16, Access.RO, volatile, source=lambda: volatile)
    return revision_of([record(0x2000, "Settings", (limit, follows, shown))], node)


@pytest.mark.parametrize(
    "changes",
    [
        {"name": "limits"},
        {"type": CanType.INTEGER16},
        {"access": Access.RO},
        {"default": b"\2\0"},
        {"low": 1},
        {"high": 5},
        {"pdo": Pdo.RECEIVE},
    ],
)
def test_a_revision_follows_whatever_a_data_sheet_says(changes: dict[str, object]) -> None:
    assert _revision(**changes) != _revision()  # type: ignore[arg-type]


def test_neither_the_node_id_nor_the_present_state_is_another_revision() -> None:
    assert _revision(node=9, volatile=b"\7\0") == _revision()


@pytest.mark.parametrize(
    "behaviour, state, reaction",
    [
        (0, NmtState.OPERATIONAL, NmtCommand.ENTER_PRE_OPERATIONAL),
        (0, NmtState.PRE_OPERATIONAL, None),
        (0, NmtState.STOPPED, None),
        (1, NmtState.OPERATIONAL, None),
        (2, NmtState.OPERATIONAL, NmtCommand.STOP),
        (2, NmtState.PRE_OPERATIONAL, NmtCommand.STOP),
    ],
)
def test_reaction_to_a_communication_error(
    behaviour: int, state: NmtState, reaction: NmtCommand | None
) -> None:
    service = ErrorBehaviour()
    Client(service.objects()).write(0x1029, 1, behaviour)
    assert service.reaction(state) is reaction


def test_unknown_behaviour_is_refused() -> None:
    Client(ErrorBehaviour().objects()).refused(0x1029, 1, 3, AbortCode.INVALID_VALUE)

"""What comes from a control socket, played by hand: losses, drops, another layout, and what is no package."""

from __future__ import annotations

import struct
from collections.abc import Generator, Iterable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.cli.rtde.gateway_source import GatewaySource
from gatewayd.cli.rtde.sources import SourceLostError, SourceRefusedError
from gatewayd.control.client import Client, NoDaemon
from gatewayd.rtde.types import DataType

LAYOUT = {"layout": {"names": ["timestamp"], "types": ["DOUBLE"], "period": 0.002}}
OTHER = {"layout": {"names": ["timestamp"], "types": ["INT32"], "period": 0.002}}


class Played(Client):
    """A gateway that answers each request with the next of these lists of objects, and has ended then."""

    def __init__(self, *answers: Iterable[Any]) -> None:
        super().__init__()
        self._answers = iter(answers)

    def follow(self, path: str, **query: str | int | None) -> Generator[dict[str, Any], None, None]:
        assert path == "/v1/packages"
        rows = next(self._answers, None)
        if rows is None:
            raise NoDaemon("no gatewayd listens")
        yield from rows


def packages(*stamps: float) -> dict[str, Any]:
    return {"packages": [[1e9 + stamp, struct.pack(">d", stamp).hex()] for stamp in stamps]}


async def test_packages_have_their_values_and_times() -> None:
    source = GatewaySource(Played([LAYOUT, packages(1.0, 2.0), {"dropped": 5}, packages(3.0)]), None, {})
    layout = await source.open()
    assert (layout.recipe.names, layout.period) == (("timestamp",), 0.002)
    assert (await source.next(5)).packages == [((1.0,), 1e9 + 1), ((2.0,), 1e9 + 2)]
    assert (await source.next(5)).lost == "the gateway dropped 5: the recorder was too slow"
    assert (await source.next(5)).packages == [((3.0,), 1e9 + 3)]
    with pytest.raises(SourceLostError, match="the gateway has ended"):
        await source.next(5)
    await source.close()


async def test_a_loss_ends_it_unless_it_is_to_go_on() -> None:
    lost = {"lost": "the cable"}
    source = GatewaySource(Played([LAYOUT, lost]), None, {})
    await source.open()
    with pytest.raises(SourceLostError, match="the cable"):
        await source.next(5)
    patient = GatewaySource(
        Played([LAYOUT, lost, LAYOUT, packages(1.0)], [LAYOUT, packages(2.0)]), None, {}, reconnect=True
    )
    await patient.open()
    arrivals = await patient.next(5)
    assert (arrivals.lost, arrivals.waiting) == ("the cable", "waiting for the robot: the cable")
    seen = [await patient.next(5) for _ in range(5)]
    assert [values for found in seen for values, _ in found.packages] == [(1.0,), (2.0,)]
    assert [found.lost for found in seen if found.lost] == ["the gateway has ended"]


async def test_other_fields_end_the_recording() -> None:
    source = GatewaySource(Played([LAYOUT, OTHER]), None, {}, reconnect=True)
    await source.open()
    with pytest.raises(SourceRefusedError, match="other fields"):
        await source.next(5)


async def test_declared_types_are_compared() -> None:
    fitting: dict[str, DataType | None] = {"timestamp": DataType.DOUBLE, "x": None}
    layout = await GatewaySource(Played([LAYOUT]), None, fitting).open()
    assert layout.recipe.types == (DataType.DOUBLE,)
    with pytest.raises(SourceRefusedError, match="timestamp was declared as INT32, the gateway has DOUBLE"):
        await GatewaySource(Played([LAYOUT]), None, {"timestamp": DataType.INT32}).open()


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=6,
)


@given(st.sampled_from(["layout", "packages", "dropped", "lost", "x"]), JSON)
async def test_whatever_comes_is_a_package_or_refused(key: str, value: object) -> None:
    source = GatewaySource(Played([LAYOUT, {key: value}]), None, {})
    await source.open()
    try:
        await source.next(5)
    except (SourceRefusedError, SourceLostError) as error:
        assert str(error) or value == ""  # noqa: PT017 - either way is right

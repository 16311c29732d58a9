from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import pytest

from gatewayd.core.definition import Value
from gatewayd.links.contract import PackageLayout, PackageTap
from tests.links.robot.rig import rigged


@dataclass
class Taken(PackageTap):
    """What a recorder gets."""

    layouts: list[PackageLayout] = field(default_factory=list)
    packages: list[tuple[Sequence[Value], float]] = field(default_factory=list)
    losses: list[str] = field(default_factory=list)

    def begin(self, layout: PackageLayout) -> None:
        self.layouts.append(layout)

    def package(self, values: Sequence[Value], time: float) -> None:
        self.packages.append((values, time))

    def lost(self, reason: str) -> None:
        self.losses.append(reason)


@pytest.mark.parametrize("joins", ["before", "in"])
async def test_packages_of_a_session_and_of_the_next_one(
    until: Callable[..., Awaitable[None]], joins: str
) -> None:
    """However the recorder comes, it has the layout first; packages have the values of the wire."""
    taken = Taken()
    async with rigged("  out: {robot: output_int_register_0, modbus: 100}\n") as rig:
        if joins == "in":
            await until(lambda: rig.cell.health.packages > 0)
        former = rig.cell.health.packages
        rig.link.tap_packages(taken)
        rig.link.tap_packages(taken)
        await until(lambda: len(taken.packages) > 5)
        (layout,) = taken.layouts
        assert layout.names == ("timestamp", "output_int_register_0")
        assert layout.types == ("DOUBLE", "INT32")
        assert f"127.0.0.1:{rig.robot.port}, software 5." in layout.robot
        assert len(taken.packages) == rig.cell.health.packages - former, "every package is handed on"
        assert all(earlier[0] < later[0] for (earlier, _), (later, _) in pairwise(taken.packages))
        assert len(layout.pack(taken.packages[0][0])) == 12
        rig.robot.drop_clients()
        await until(lambda: len(taken.layouts) > 1)
        assert len(taken.losses) == 1
        rig.link.tap_packages(None)
        count = len(taken.packages)
        before = rig.cell.health.packages
        await until(lambda: rig.cell.health.packages > before + 5)
        assert len(taken.packages) == count

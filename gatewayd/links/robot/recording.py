"""Packages of a robot on their way to what records them."""

from __future__ import annotations

from collections.abc import Sequence

from gatewayd.core.definition import Value
from gatewayd.links.contract import PackageLayout, PackageTap
from gatewayd.rtde.session import Session


class RecordedPackages:
    """What a link hands on while somebody records; nothing otherwise."""

    __slots__ = ("_robot", "_tap")

    def __init__(self, robot: str) -> None:
        self._robot = robot
        self._tap: PackageTap | None = None

    def hand_to(self, tap: PackageTap | None, session: Session | None) -> None:
        """Hand `tap` what comes from now on, in the present session and in those to come; None: nobody."""
        if tap is not self._tap:
            self._tap = tap
            if session is not None:
                self.begin(session)

    def begin(self, session: Session) -> None:
        """A session has begun."""
        if self._tap is not None:
            outputs = session.outputs
            words = tuple(kind.word for kind in outputs.types)
            robot = f"{self._robot}, software {session.controller}"
            self._tap.begin(PackageLayout(robot, outputs.names, words, session.period, outputs.pack))

    def package(self, values: Sequence[Value], now: float) -> None:
        """A package has come."""
        if self._tap is not None:
            self._tap.package(values, now)

    def lost(self, reason: str) -> None:
        """The session has ended."""
        if self._tap is not None:
            self._tap.lost(reason)

"""What `gatewayd doctor` looks at: whether the socket can be had."""

from __future__ import annotations

import socket
from collections.abc import AsyncIterator

from gatewayd.core.definition import CellDefinition
from gatewayd.links.examination import Examination, Observation, Outcome, Surroundings
from gatewayd.mapping.plan import LinkPlan
from gatewayd.report.format import address

from .declaration import KIND
from .plan import LinesPlan


class LinesExamination(Examination):
    """One look at one socket."""

    async def examine(
        self, plan: LinkPlan, cell: CellDefinition, around: Surroundings
    ) -> AsyncIterator[Observation]:
        """The socket is free, or the running gateway's, or somebody else's."""
        assert isinstance(plan, LinesPlan)
        where = address(*plan.listen)
        if any(link.get("listen") == where for known in around.running for link in known.links(KIND.title)):
            yield Observation.well("socket", f"{where} is served by the running gateway")
            return
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as attempt:
            try:
                attempt.bind(plan.listen)
            except OSError as error:
                text = f"{where}: {error.strerror}"
                remedy = "choose another port (`lines: listen:`)"
                yield Observation("socket", Outcome.PROBLEM, text, "another program has it", remedy)
            else:
                yield Observation.well("socket", f"{where} is free")


EXAMINATION = LinesExamination()
"""Looks at what this kind of link needs."""

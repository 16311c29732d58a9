"""A simulated robot that writes down every input package that it accepts: `robot HOST RELEASE LOG`.

RELEASE: seconds after which it drops a client that reads or acknowledges nothing. Each line of LOG is a JSON list:
time, what (`write`, `gone`), client, fields, who holds their claims.
"""

from __future__ import annotations

import asyncio
import json
import sys
import time
from pathlib import Path

from gatewayd.rtde.messages import DataPackage
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.faults import Faults
from gatewayd.simulator.server import SimulatedController
from gatewayd.simulator.session import SimulatorSession


def main(host: str, release: float, log: Path) -> None:
    """Serve until killed."""
    stream = log.open("w", buffering=1)
    accept, close = SimulatorSession._data, SimulatorSession.close

    def note(what: str, session: SimulatorSession, fields: tuple[str, ...] = ()) -> None:
        claims = session._controller.claims
        holders = sorted({str(claims.owner(field)) for field in fields})
        stream.write(json.dumps([time.monotonic(), what, str(session), fields, holders]) + "\n")

    def data(session: SimulatorSession, message: DataPackage) -> None:
        number = message.recipe or 0
        names = (
            session._inputs[number - 1].recipe.names if 1 <= number <= len(session._inputs) else ("unknown",)
        )
        note("write", session, tuple(names))
        accept(session, message)

    def gone(session: SimulatorSession) -> None:
        note("gone", session)
        close(session)

    setattr(SimulatorSession, "_data", data)  # noqa: B010 - it is a method that is replaced
    setattr(SimulatorSession, "close", gone)  # noqa: B010

    async def serve() -> None:
        async with SimulatedController(
            Controller(faults=Faults(overflow_close=release)), host=host, port=30004
        ):
            print("listening", flush=True)
            await asyncio.get_running_loop().create_future()

    asyncio.run(serve())


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]), Path(sys.argv[3]))

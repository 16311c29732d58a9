"""A controller gone mad: the client reports losses and nothing else. GATEWAYD_FUZZ_CASES sets how often."""

from __future__ import annotations

import asyncio
import os
import random
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import TYPE_CHECKING

from gatewayd.rtde.loss import LossReason
from tests.rtde.conftest import send

if TYPE_CHECKING:
    from tests.rtde.conftest import Connected, Controller

CASES = int(os.environ.get("GATEWAYD_FUZZ_CASES", "5000"))
CONNECTIONS = CASES // 100
INPUTS = tuple(f"input_int_register_{number}" for number in range(24))


def spoiled(rng: random.Random, package: bytes) -> bytes:
    data = bytearray(package)
    match rng.randrange(4):
        case 0:
            data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        case 1:
            del data[rng.randrange(len(data)) :]
        case 2:
            data += rng.randbytes(rng.randint(1, 9))
        case _:
            data *= 2
    return bytes(data)


async def test_no_answer_of_a_controller_harms_the_client(
    controller: Controller, connected: Connected, until: Callable[..., Awaitable[None]]
) -> None:
    """Each connection gets the right answers with some of them spoiled, then the client still works."""
    rng = random.Random(1)

    def spoil(package: bytes) -> bytes:
        return spoiled(rng, package) if rng.random() < controller.script.spoiled else package

    controller.script.spoil = spoil
    controller.script.spoiled = 0.2
    settings = {"handshake_timeout": 0.02, "data_timeout": 0.05, "backoff": 0.0, "backoff_limit": 0.0}
    async with connected(inputs=INPUTS, claim_retry=0.01, first_data_timeout=0.05, **settings) as (
        client,
        seen,
    ):
        while len(seen.losses) < CONNECTIONS:
            registers = client.session.inputs.get("registers") if client.session is not None else None
            if registers is not None:
                assert send(client, "registers", [0] * registers.recipe.count)
            await asyncio.sleep(0.001)
        reasons = {loss.reason for loss in seen.losses}
        assert {LossReason.PROTOCOL, LossReason.UNANSWERED} <= reasons
        assert client.statistics.strange.total
        controller.script.spoiled = 0.0
        with suppress(TimeoutError):
            await until(lambda: False, 0.2)
        count = len(seen.packages)
        await until(lambda: len(seen.packages) > count + 10)

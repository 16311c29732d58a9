"""Send way points to a robot program, with a watchdog: python control_loop.py HOST [PORT] [POINTS].

The robot program reads six doubles from 24 on when integer 25 has changed, moves there, and then puts the number into
its output integer 25. It stops when integer 24 is not fed: rtde_set_watchdog("input_int_register_24", 10, "stop").
"""

import argparse
import asyncio

from gatewayd import rtde

POSES = [(-0.12, -0.43, 0.14, 0.0, 3.11, 0.04), (-0.12, -0.51, 0.21, 0.0, 3.11, 0.04)]
POINT = [f"input_double_register_{number}" for number in range(24, 30)]
INPUTS = {"point": [*POINT, "input_int_register_25"], "watchdog": ["input_int_register_24"]}


async def main(host: str, port: int, points: int) -> None:
    outputs = ["actual_TCP_pose", "output_int_register_25"]
    async with rtde.connect(host, port=port, outputs=outputs, inputs=INPUTS, frequency=125) as robot:
        feeding = asyncio.create_task(feed(robot))
        try:
            for number in range(1, points + 1):
                pose = POSES[number % len(POSES)]
                await robot.write(
                    "point", {**dict(zip(POINT, pose, strict=True)), "input_int_register_25": number}
                )
                async for sample in robot:
                    if sample.output_int_register_25 == number:
                        print(f"point {number} reached at {sample.timestamp:.3f} s")
                        break
        finally:
            feeding.cancel()


async def feed(robot: rtde.Robot) -> None:
    """Ten times a second, twice as often as the robot program demands."""
    while True:
        await robot.write("watchdog", input_int_register_24=1)
        await asyncio.sleep(0.05)


arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("host")
arguments.add_argument("port", nargs="?", type=int, default=30004)
arguments.add_argument("points", nargs="?", type=int, default=4)
asyncio.run(main(**vars(arguments.parse_args())))

"""Without asyncio, as in a script or a notebook: python notebook.py HOST [PORT]."""

import argparse

from gatewayd.rtde import sync


def main(host: str, port: int) -> None:
    inputs = {"in": ["input_int_register_24"]}
    with sync.connect(host, port=port, outputs=["actual_q", "target_speed_fraction"], inputs=inputs) as robot:
        print("joint 1:", robot.newer(timeout=2).actual_q[0])
        robot.write("in", input_int_register_24=7, verify=True)
        print("the controller has taken 7")
        robot.message("hello from a notebook")


arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("host")
arguments.add_argument("port", nargs="?", type=int, default=30004)
main(**vars(arguments.parse_args()))

"""The digital I/O in the terminal; a number and Enter toggles a standard output: python io_panel.py HOST [PORT].

Other inputs: `q` ends it. The outputs stay as they are.
"""

import argparse
import asyncio
import sys

from gatewayd import rtde

OUTPUTS = ["actual_digital_input_bits", "actual_digital_output_bits"]
INPUTS = {"io": ["standard_digital_output_mask", "standard_digital_output"]}


async def main(host: str, port: int) -> None:
    async with rtde.connect(host, port=port, outputs=OUTPUTS, inputs=INPUTS, frequency=25) as robot:
        panel = asyncio.create_task(show(robot))
        try:
            while (word := (await asyncio.to_thread(sys.stdin.readline)).strip()) and word != "q":
                if not word.isdecimal() or int(word) > 7:
                    print(f"{word!r} is not an output: 0 to 7, or q")
                    continue
                sample = await robot.newer(timeout=2)
                is_on = sample.actual_digital_output_bits >> int(word) & 1
                await robot.set_standard_digital_outputs({int(word): not is_on})
        finally:
            panel.cancel()


async def show(robot: rtde.Robot) -> None:
    """Print a line whenever something has changed."""
    shown = None
    async for sample in robot.stream():
        bits = sample.actual_digital_input_bits, sample.actual_digital_output_bits
        if bits != shown:
            print(f"in {bits[0] & 0xFF:08b}  out {bits[1] & 0xFF:08b}", flush=True)
            shown = bits


arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("host")
arguments.add_argument("port", nargs="?", type=int, default=30004)
asyncio.run(main(**vars(arguments.parse_args())))

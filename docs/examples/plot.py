"""Draw joint angles of a recording: python plot.py FILE PICTURE. Needs the extras `numpy` and `plot`."""

import argparse

import matplotlib.pyplot as plt

from gatewayd.rtde.recording import read_arrays


def main(file: str, picture: str) -> None:
    fields = read_arrays(file)
    seconds = fields["timestamp"] - fields["timestamp"][0]
    plt.plot(seconds, fields["actual_q"], label=[f"joint {number}" for number in range(1, 7)])
    plt.xlabel("time [s]")
    plt.ylabel("actual_q [rad]")
    plt.legend()
    plt.savefig(picture)


arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("file")
arguments.add_argument("picture")
main(**vars(arguments.parse_args()))

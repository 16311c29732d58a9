"""The robot side of a cell: its RTDE client and its part of the process image."""

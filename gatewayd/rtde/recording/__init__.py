"""Recordings of RTDE packages, in the formats of the official Python client.

with create_recording("robot_data.csv", recipe) as recording:
    recording.write(values)

with open_recording("robot_data.csv") as recording:
    for values in recording:
        print(values[recording.recipe.slots["actual_q"]])
"""

from gatewayd.rtde.recording.arrays import read_arrays
from gatewayd.rtde.recording.conversion import RecordingFormat, convert
from gatewayd.rtde.recording.errors import (
    MissingExtraError,
    RecordingError,
    RecordingExistsError,
    RecordingWriteError,
)
from gatewayd.rtde.recording.gaps import GapWatch, GapWriter, RecordedGap, read_gaps
from gatewayd.rtde.recording.layout import HOST_TIME, columns
from gatewayd.rtde.recording.reading import RecordingReader, open_recording
from gatewayd.rtde.recording.running import program_runs
from gatewayd.rtde.recording.writing import RecordingWriter, create_recording

__all__ = [
    "HOST_TIME",
    "GapWatch",
    "GapWriter",
    "MissingExtraError",
    "RecordedGap",
    "RecordingError",
    "RecordingExistsError",
    "RecordingFormat",
    "RecordingReader",
    "RecordingWriteError",
    "RecordingWriter",
    "columns",
    "convert",
    "create_recording",
    "open_recording",
    "program_runs",
    "read_arrays",
    "read_gaps",
]

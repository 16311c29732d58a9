"""What a person can do something about when recordings are written and read."""

from __future__ import annotations


class RecordingError(Exception):
    """A recording that cannot be written or read; the text names the file, where it can the line, and what to do."""


class RecordingExistsError(RecordingError):
    """The file is there already, and was not to be overwritten."""

    def __init__(self, path: str) -> None:
        super().__init__(f"{path}: is there already; choose another name")
        self.path = path


class MissingExtraError(RecordingError):
    """A package is needed that only an extra of gatewayd brings."""

    def __init__(self, purpose: str, extra: str, absent: str) -> None:
        super().__init__(
            f"{purpose} needs the package {absent}, which is not installed: pip install 'gatewayd[{extra}]'"
        )

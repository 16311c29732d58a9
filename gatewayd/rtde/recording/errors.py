"""What a person can do something about when recordings are written and read."""

from __future__ import annotations


class RecordingError(Exception):
    """A recording that cannot be written or read; the text names the file, where it can the line, and what to do."""


class RecordingExistsError(RecordingError):
    """The file is there already, and was not to be overwritten."""

    def __init__(self, path: str) -> None:
        super().__init__(f"{path}: is there already; choose another name")
        self.path = path


class RecordingWriteError(RecordingError):
    """The system does not take what is to be written: a full disk, a quota, a missing right."""

    def __init__(self, path: str, error: OSError | ValueError, outcome: str) -> None:
        self.reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        """Why, in the system's words."""
        super().__init__(f"{path}: {outcome.format(reason=self.reason)}")


class MissingExtraError(RecordingError):
    """A package is needed that only an extra of gatewayd brings."""

    def __init__(self, purpose: str, extra: str, absent: str) -> None:
        super().__init__(
            f"{purpose} needs the package {absent}, which is not installed: pip install 'gatewayd[{extra}]'"
        )

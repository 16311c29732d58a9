"""The options of `gatewayd run`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gatewayd.web.settings import Settings


@dataclass(frozen=True, slots=True)
class Options:
    """What the command line says."""

    files: Sequence[Path]
    """Mapping files, and directories of them."""
    state: Path | None = None
    """Directory of what is kept across restarts; None: that of the service or of the user."""
    control: Path | None = None
    """The control socket; None: at its usual place, `none`: without."""
    audit: Path | None = None
    page: Settings | None = None
    """The status listener; None: without."""
    strict: bool = False

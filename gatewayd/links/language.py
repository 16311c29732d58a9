"""What a kind of link adds to the mapping language: the part of the contract that `check` and the compiler need."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, ClassVar

from gatewayd.mapping.plan import LinkPlan
from gatewayd.mapping.section import Section

__all__ = ["LinkLanguage"]


class LinkLanguage:
    """One kind's sections, places, writers' keys, expansion, compilation and rules."""

    section: ClassVar[type[Section]]
    """The table at the top of the file, at the key of the kind."""
    required: ClassVar[bool] = False
    variable_keys: ClassVar[type[Section] | None] = None
    """Keys that a variable has by this kind: a mixin of `VariableSpec`."""
    writer_keys: ClassVar[type[Section] | None] = None
    """Keys that a writer has by this kind: a mixin of `WriterSpec`."""
    rules: ClassVar[tuple[str, ...]] = ()
    """Modules whose import enters the kind's rules."""
    nested: ClassVar[Mapping[tuple[type[Section], str], type[Section]]] = {}
    """Sections inside sections, by the first step of the path that leads there."""
    articles: ClassVar[Mapping[type[Section], str]] = {}
    """What its sections are called in a finding: `the section \\`modbus\\``."""

    def expand(self, part: Any, document: Any, variables: Sequence[Any]) -> Any:
        """The kind's side of a cell, laid out (`ExpandedCell.links`). Never raises, whatever valid parts it holds."""
        raise NotImplementedError

    def compile(self, cell: Any, expanded: Any) -> LinkPlan:
        """The plan of a cell without errors."""
        raise NotImplementedError

    def supervises(self, writer: Any) -> Iterable[str]:
        """How it is noticed that the writer hangs, be its connection open or not; nothing: by this kind it is not."""
        return ()

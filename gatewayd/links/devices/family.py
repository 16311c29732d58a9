"""What a family of devices has to say and do, beside what all devices have in common."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

from gatewayd.links.devices.plan import DevicePlan

if TYPE_CHECKING:
    from gatewayd.core.cell import Cell
    from gatewayd.core.definition import CellDefinition
    from gatewayd.links.can_buses import BusUse
    from gatewayd.links.contract import Context, Description, Link, SharedPart
    from gatewayd.links.devices.places import ExpandedPlace
    from gatewayd.links.devices.sections import DevicePlaceSpec, DeviceSpec
    from gatewayd.mapping.document import Document, Part
    from gatewayd.mapping.expanded import ExpandedCell, ExpandedVariable
    from gatewayd.mapping.reach import Reach

FamilyDescription = Callable[[DevicePlan, "CellDefinition"], "Description"]
"""Puts a plan into words: settings, places and address; writers are added for all families alike."""


class FamilyLanguage:
    """A family's part of the mapping language."""

    name: ClassVar[str]
    selectors: ClassVar[tuple[str, ...]]
    """Keys of a device by which it is of this family: exactly one of all families' stands in the file."""
    device_keys: ClassVar[frozenset[str]]
    """Keys that only devices of this family have, selectors as well."""
    place_selectors: ClassVar[tuple[str, ...]]
    """Keys of a place of which it has exactly one."""
    place_keys: ClassVar[frozenset[str]]
    """Keys that only places in devices of this family have."""
    place_example: ClassVar[str]
    """What a place has besides `at`: `holding: 100`."""

    def expand(
        self,
        document: Document,
        device: Part[DeviceSpec],
        spec: DevicePlaceSpec,
        variables: Sequence[ExpandedVariable],
        number: int,
    ) -> Sequence[Any]:
        """Where each variable of a line lies in the device by the line's place with this number. Never raises."""
        raise NotImplementedError

    def is_laid_out(self, where: Any) -> bool:
        """Whether a variable can lie in one of these places; rules say why not."""
        return True

    def reach(self, where: Any) -> Reach | None:
        """What one of these places shows; None: all that its variable has, or what is asked for elsewhere."""
        return None

    def bus_uses(
        self, cell: ExpandedCell, device: Part[DeviceSpec], places: Sequence[ExpandedPlace]
    ) -> Iterable[BusUse]:
        """What a device is on a CAN bus."""
        return ()

    def row(self, where: Any) -> Mapping[str, object]:
        """What tables show of one of these places: `device_place`, `device_type`, `device_scale`, `device_offset`."""
        raise NotImplementedError

    def pdos(
        self, document: Document, device: Part[DeviceSpec], places: Sequence[ExpandedPlace]
    ) -> Mapping[int, str]:
        """Place, by its number among those of the device -> PDO that carries it: what has one is not polled."""
        return {}

    def compile(
        self,
        cell: ExpandedCell,
        device: Part[DeviceSpec],
        places: Sequence[ExpandedPlace],
        common: Mapping[str, Any],
    ) -> DevicePlan:
        """The plan of a device without errors; `common`: what its plan has of `DevicePlan`."""
        raise NotImplementedError


class FamilyRuntime:
    """Makes links of a family."""

    def share(self) -> SharedPart:
        """What all links of the family use together: lines, interfaces."""
        raise NotImplementedError

    def make(self, plan: DevicePlan, cell: Cell, context: Context) -> Link:
        """A link that does nothing before its `run`; `Context.shared` is what `share` made."""
        raise NotImplementedError

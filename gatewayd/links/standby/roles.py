"""What a gateway is to its cell, as a table of roles and signals. Pure: time and what is seen come in.

The robot decides: who holds the claim is the writer, and nobody else can be. Roles only see to it that the address
follows the claim, and that a gateway which cannot have both leaves both to the other.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum


class StandbyRole(Enum):
    """The numbers are in heartbeats and in the status block: never renumber, only append."""

    STANDING_BY = 1
    """It reads the robot, holds nothing, and asks for the claim again and again."""
    MISMATCHED = 2
    """The other gateway has another mapping: it asks for nothing until they agree."""
    TAKING_ADDRESS = 3
    """It holds the claim, and waits for the virtual address."""
    ACTIVE = 4
    """It holds the claim and the address, and serves the cell."""
    RECOVERING = 5
    """It serves the cell, and has lost the session with the robot: it claims again at once."""
    LEAVING = 6
    """It has given the claim back, and leaves it to the other for a while."""

    @property
    def words(self) -> str:
        """For people."""
        return self.name.lower().replace("_", " ")

    @property
    def serves(self) -> bool:
        """Whether the cell's links run."""
        return self in {StandbyRole.ACTIVE, StandbyRole.RECOVERING}

    @property
    def has_claim(self) -> bool:
        """Whether the claim is, or was until just now, this gateway's: it may have the address."""
        return self in {StandbyRole.TAKING_ADDRESS, StandbyRole.ACTIVE, StandbyRole.RECOVERING}


class RoleSignal(Enum):
    """What moves it, as `StandbyStation` reads it from what it sees."""

    DIFFERS = "the mapping of the other gateway differs"
    AGREES = "the mappings agree again"
    CLAIMED = "the robot's inputs are claimed"
    SESSION_LOST = "the session with the robot was lost"
    TAKEN = "the other gateway holds the robot's inputs"
    ADDRESS_HELD = "the virtual address is here"
    ADDRESS_LOST = "the virtual address is no longer here"
    NO_ADDRESS = "the virtual address did not come"
    OTHER_CONNECTED = "the other gateway reaches the robot, this one does not"
    ASKED_TO_LEAVE = "handed over by an operator"
    TIME_UP = "the other gateway had its time"
    OTHER_ACTIVE = "the other gateway serves the cell"


MOVES: Mapping[tuple[StandbyRole, RoleSignal], StandbyRole] = {
    (StandbyRole.STANDING_BY, RoleSignal.DIFFERS): StandbyRole.MISMATCHED,
    (StandbyRole.STANDING_BY, RoleSignal.CLAIMED): StandbyRole.TAKING_ADDRESS,
    (StandbyRole.MISMATCHED, RoleSignal.AGREES): StandbyRole.STANDING_BY,
    (StandbyRole.TAKING_ADDRESS, RoleSignal.ADDRESS_HELD): StandbyRole.ACTIVE,
    (StandbyRole.TAKING_ADDRESS, RoleSignal.NO_ADDRESS): StandbyRole.LEAVING,
    (StandbyRole.TAKING_ADDRESS, RoleSignal.SESSION_LOST): StandbyRole.STANDING_BY,
    (StandbyRole.ACTIVE, RoleSignal.SESSION_LOST): StandbyRole.RECOVERING,
    (StandbyRole.ACTIVE, RoleSignal.ADDRESS_LOST): StandbyRole.LEAVING,
    (StandbyRole.ACTIVE, RoleSignal.ASKED_TO_LEAVE): StandbyRole.LEAVING,
    (StandbyRole.RECOVERING, RoleSignal.CLAIMED): StandbyRole.ACTIVE,
    (StandbyRole.RECOVERING, RoleSignal.TAKEN): StandbyRole.STANDING_BY,
    (StandbyRole.RECOVERING, RoleSignal.OTHER_CONNECTED): StandbyRole.STANDING_BY,
    (StandbyRole.RECOVERING, RoleSignal.ADDRESS_LOST): StandbyRole.STANDING_BY,
    (StandbyRole.LEAVING, RoleSignal.TIME_UP): StandbyRole.STANDING_BY,
    (StandbyRole.LEAVING, RoleSignal.OTHER_ACTIVE): StandbyRole.STANDING_BY,
}
"""StandbyRole and signal -> the next role; every other signal changes nothing."""

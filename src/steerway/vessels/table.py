"""The declaration of a vessel for scenarios: its keys, how it is built, and the numbers its controllers use."""

from abc import abstractmethod
from typing import ClassVar, Literal

from steerway.control.boats import Boat
from steerway.core.schema import Table
from steerway.vessels.vessel import Vessel


class VesselTable(Table):
    """The table [vessel] of a scenario. A vessel adds its `kind` (a Literal with itself as default) and its keys.

    `reference` is the kind of reference filter used where the scenario names none; see `guidance.shapers`.
    """

    method: Literal["rk4", "euler"] = "rk4"
    reference: ClassVar[str] = "low-pass"

    @abstractmethod
    def build(self) -> Vessel:
        """The vessel. Raises InputError for numbers that exclude each other."""

    @abstractmethod
    def boat(self) -> Boat:
        """The numbers and default gains its controllers use."""

    def boat_in_current(self) -> Boat:
        """The same for steering by an estimator that knows the orders, whose response to them has to fit well."""
        return self.boat()

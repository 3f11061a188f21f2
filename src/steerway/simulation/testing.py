"""Names for this package's tests; not part of the public API."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.guidance.route_table import OriginTable
    from steerway.simulation import assembly
    from steerway.simulation.advising import advise, steering_loop, tolerated_current
    from steerway.simulation.assembly import begins, boat, pilot
    from steerway.simulation.bound import course_bound
    from steerway.simulation.loop import COLUMNS
    from steerway.simulation.manoeuvres import limits, manoeuvre_of
    from steerway.simulation.outcome import errors, evaluated
    from steerway.simulation.runs.campaign import write_campaign
    from steerway.simulation.runs.files import NAMES, write
    from steerway.simulation.runs.page import write_story

__getattr__, __dir__ = on_demand(__name__)

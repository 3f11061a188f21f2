"""The keys of a scenario: everything a simulation needs.

Keys are SI; angles are in degrees and their keys end in `_deg`. Every key has a default. Vessels, instruments, guidance
laws and reference filters declare their own keys, in their own files.
"""

from functools import cached_property
from typing import Annotated, Any, Literal

from pydantic import Field, create_model

from steerway.core.records import AID_COLUMNS
from steerway.core.reference import ReferenceTable
from steerway.core.settings import NotNegative, Number, Positive, Table
from steerway.estimation.estimator_tables import EstimatorSettings
from steerway.guidance.laws import GuidanceTable
from steerway.guidance.ordered import OrderTable
from steerway.guidance.route_table import OriginTable, RouteKeys, StayWaypointTable
from steerway.sensors.gnss import GnssTable
from steerway.sensors.instrument import InstrumentTable
from steerway.sensors.kinds import INSTRUMENTS
from steerway.simulation.positioning import KINDS as POSITIONING_KINDS
from steerway.simulation.positioning import PositioningEstimatorTable, PositioningTable
from steerway.vessels.environment import Environment, Wind
from steerway.vessels.kinds import TABLES, AnyVesselTable


class StartTable(Table):
    """The initial state of the vessel."""

    north: Annotated[Number, "m"] = 0.0
    """Initial position north of the origin."""
    east: Annotated[Number, "m"] = 0.0
    """Initial position east of the origin."""
    heading_deg: Number = 0.0
    """Initial heading, from true north."""
    speed: Annotated[NotNegative | None, "m/s"] = None
    """Initial speed through the water; by default the vessel's own, or 0."""


class WindTable(Wind):
    """Wind, with Gauss–Markov gusts, on a boat with windage."""

    drag_area: Annotated[NotNegative, "m²"] = 0.4


class EnvironmentTable(Environment):
    """Current, wind, waves, and a constant force and moment with Gauss–Markov variations."""

    wind: WindTable = WindTable()


class EstimatorTable(EstimatorSettings):
    """The filter in the loop; with "truth" the pilot uses the true motion.

    "steering" also uses the orders, and estimates heading, current and the boat's response. "vessel-filter", "tekf" and
    "passive-observer" use the vessel's forces: for dynamic positioning.
    """

    kind: Literal["five-state", "steering", "truth", *POSITIONING_KINDS] = "five-state"  # type: ignore[valid-type]
    """Estimator in the loop; "truth" replaces it by the true motion."""
    profile: str | None = None
    """Built-in profile or a .toml file; by default the vessel's with the errors of the simulated receiver."""
    aid: tuple[Literal[*AID_COLUMNS], ...] = ()  # type: ignore[valid-type]
    """Measurements that the filter of the course uses beside positions."""
    positioning: PositioningEstimatorTable = PositioningEstimatorTable()
    """Noise assumed for dynamic positioning."""


class AutopilotTable(Table):
    """Autopilot: pole placement on Nomoto's model, MPC or LQG; keys left out take the vessel's own values."""

    kind: Literal["pole-placement", "mpc", "lqg"] = "pole-placement"
    """Pole placement on Nomoto's model, model predictive control or LQG."""
    bandwidth: Annotated[Positive | None, "rad/s"] = None
    """Natural frequency ω_n of the heading loop; by default the vessel's."""
    damping: Annotated[Positive | None, "1"] = None
    """Damping ratio of the heading loop; by default the vessel's."""
    nomoto_gain: Annotated[Positive | None, "rad/s for one unit of the autopilot's output"] = None
    """Gain K of the yaw response; by default the vessel's."""
    nomoto_time: Annotated[Positive | None, "s"] = None
    """Time constant T of the yaw response; by default the vessel's."""


class SpeedTable(Table):
    """Control of the speed over ground: PI, adaptive, or a disturbance observer."""

    controller: Literal["pi", "adaptive", "disturbance-observer"] = "pi"
    """Speed controller."""
    cruise: Annotated[NotNegative | None, "m/s"] = None
    """Speed over ground where waypoint or order gives none; by default the vessel's."""
    bandwidth: Annotated[Positive | None, "rad/s"] = None
    """Bandwidth of the PI loop, or of the reference that the other controllers follow."""
    force: Annotated[Positive | None, "N"] = None
    """Constant thrust in place of a speed loop."""


class StationTable(Table):
    """Station keeping at waypoints and at the end of the route."""

    bandwidth: Annotated[Positive, "rad/s"] = 0.2
    """Bandwidth of the position loop."""
    radius: Annotated[Positive, "m"] = 5.0
    """Radius within which the boat may drift."""


class RouteTable(RouteKeys):
    """The route: waypoints, then the lines of a survey; rules for passing waypoints, for corners and for the end."""

    waypoints: tuple[StayWaypointTable, ...] = ()
    """Waypoints in the order in which they are passed."""
    at_end: Literal["stop", "hold", "continue"] = "stop"
    """After the last waypoint, stop, hold the position or continue on the last course."""
    passing: Literal["remaining", "circle"] = "remaining"
    """Whether a waypoint is passed at a remaining distance along the leg, or within a circle."""

    @cached_property
    def points(self) -> tuple[StayWaypointTable, ...]:
        """The waypoints given, and those of the survey."""
        lines = () if self.survey is None else self.survey.points()
        return (*self.waypoints, *(StayWaypointTable(**each) for each in lines))


_FITTED: dict[str, Any] = {
    name: (table | None, Field(None, description=f"{table.__doc__}".partition(".")[0]))
    for name, table in INSTRUMENTS.items()
}
_Instruments: Any = create_model("_Instruments", __base__=Table, __module__=__name__, **_FITTED)


class Scenario(_Instruments):  # type: ignore[misc]
    """A scenario: everything that a simulation needs.

    In addition to the fields below it has one table per instrument of `sensors.kinds`; None: not fitted.
    """

    name: str = "simulation"
    """Name of the scenario."""
    description: str = ""
    """Description of the scenario."""
    duration: Annotated[float, Field(strict=True, gt=0.0, le=1e7), "s"] = 600.0
    """Longest simulated time."""
    step: Annotated[float, Field(strict=True, gt=0.0, le=10.0), "s"] = 0.02
    """Time step of the simulation."""
    seed: Annotated[int, Field(strict=True, ge=0), "1"] = 1
    """Seed of all random numbers."""
    begins: str = "2026-06-01T12:00:00Z"
    """Time (ISO 8601) at which the run begins."""
    origin: OriginTable = OriginTable()
    """Position where north and east are 0."""
    vessel: AnyVesselTable = TABLES[0]()
    """Model of the vessel."""
    start: StartTable = StartTable()
    """Initial state of the vessel."""
    environment: EnvironmentTable = EnvironmentTable()
    """Current, wind, waves and forces."""
    gnss: GnssTable = GnssTable()
    """GNSS receiver."""
    estimator: EstimatorTable = EstimatorTable()
    """Estimator in the loop."""
    guidance: GuidanceTable = GuidanceTable()
    """Guidance law."""
    reference: ReferenceTable = ReferenceTable()
    """Reference filter between guidance and autopilot."""
    autopilot: AutopilotTable = AutopilotTable()
    """Course and heading control."""
    speed: SpeedTable = SpeedTable()
    """Speed control."""
    station: StationTable = StationTable()
    """Station keeping."""
    positioning: PositioningTable = PositioningTable()
    """Controller of dynamic positioning."""
    route: RouteTable = RouteTable()
    """Route to follow."""
    orders: tuple[OrderTable, ...] = ()
    """Orders at given times, in place of a route."""
    manoeuvre: str | None = None
    """Standard manoeuvre in place of a route."""

    def instruments(self) -> dict[str, InstrumentTable]:
        """Tables of the instruments fitted in addition to the receiver, by name."""
        return {name: getattr(self, name) for name in INSTRUMENTS if getattr(self, name) is not None}

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
from steerway.estimation.estimator_tables import HeadingEstimatorTable, SpeedEstimatorTable
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
    """The initial state: m from the origin; speed through the water, by default the vessel's own or 0."""

    north: Annotated[Number, "m"] = 0.0
    east: Annotated[Number, "m"] = 0.0
    heading_deg: Number = 0.0
    speed: Annotated[NotNegative | None, "m/s"] = None


class WindTable(Wind):
    """Wind, with Gauss–Markov gusts, on a boat with windage."""

    drag_area: Annotated[NotNegative, "m²"] = 0.4


class EnvironmentTable(Environment):
    """Current, wind, waves, and a constant force and moment with Gauss–Markov variations."""

    wind: WindTable = WindTable()


class EstimatorTable(Table):
    """The filter in the loop; with "truth" the pilot uses the true motion.

    "steering" also uses the orders, and estimates heading, current and the boat's response. "vessel-filter", "tekf" and
    "passive-observer" use the vessel's forces: for dynamic positioning. `profile`: a built-in name or a .toml file; by
    default, the vessel's motion with the errors of the simulated receiver.
    """

    kind: Literal["five-state", "steering", "truth", *POSITIONING_KINDS] = "five-state"  # type: ignore[valid-type]
    profile: str | None = None
    aid: tuple[Literal[*AID_COLUMNS], ...] = ()  # type: ignore[valid-type]
    heading: HeadingEstimatorTable = HeadingEstimatorTable()
    speed: SpeedEstimatorTable = SpeedEstimatorTable()
    positioning: PositioningEstimatorTable = PositioningEstimatorTable()


class AutopilotTable(Table):
    """Autopilot: pole placement on Nomoto's model, MPC or LQG; keys left out take the vessel's own values."""

    kind: Literal["pole-placement", "mpc", "lqg"] = "pole-placement"
    bandwidth: Annotated[Positive | None, "rad/s"] = None
    damping: Annotated[Positive | None, "1"] = None
    nomoto_gain: Annotated[Positive | None, "rad/s for one unit of the autopilot's output"] = None
    nomoto_time: Annotated[Positive | None, "s"] = None


class SpeedTable(Table):
    """Control of the speed over ground: PI, adaptive, or a disturbance observer. `cruise`: used between waypoints that
    set no speed.

    `bandwidth`: of the PI loop, or of the reference that the others follow. `force`: a constant thrust in place of a
    loop.
    """

    controller: Literal["pi", "adaptive", "disturbance-observer"] = "pi"
    cruise: Annotated[NotNegative | None, "m/s"] = None
    bandwidth: Annotated[Positive | None, "rad/s"] = None
    force: Annotated[Positive | None, "N"] = None


class StationTable(Table):
    """Station keeping: bandwidth of the position loop, and `radius` within which the boat may drift."""

    bandwidth: Annotated[Positive, "rad/s"] = 0.2
    radius: Annotated[Positive, "m"] = 5.0


class RouteTable(RouteKeys):
    """The route: waypoints, then the lines of a survey; rules for passing waypoints, for corners and for the end.

    Corners: "exact" passes the waypoints; "arc" and "clothoid" cut corners with a radius of at least `corner_radius`,
    by default 1.5 times that of the tightest turn.
    """

    waypoints: tuple[StayWaypointTable, ...] = ()
    at_end: Literal["stop", "hold", "continue"] = "stop"
    passing: Literal["remaining", "circle"] = "remaining"

    @cached_property
    def points(self) -> tuple[StayWaypointTable, ...]:
        """The waypoints given, and those of the survey."""
        lines = () if self.survey is None else self.survey.points()
        return (*self.waypoints, *(StayWaypointTable(**each) for each in lines))


_FITTED: dict[str, Any] = {name: (each | None, None) for name, each in INSTRUMENTS.items()}
_Instruments: Any = create_model("_Instruments", __base__=Table, __module__=__name__, **_FITTED)


class Scenario(_Instruments):  # type: ignore[misc]
    """A scenario: everything that a simulation needs.

    In addition to the fields below it has one table per instrument of `sensors.kinds`; None: not fitted.
    """

    name: str = "simulation"
    description: str = ""
    duration: Annotated[float, Field(strict=True, gt=0.0, le=1e7), "s"] = 600.0
    step: Annotated[float, Field(strict=True, gt=0.0, le=10.0), "s"] = 0.02
    seed: Annotated[int, Field(strict=True, ge=0), "1"] = 1
    begins: str = "2026-06-01T12:00:00Z"  # of the logs that are written
    origin: OriginTable = OriginTable()
    vessel: AnyVesselTable = TABLES[0]()
    start: StartTable = StartTable()
    environment: EnvironmentTable = EnvironmentTable()
    gnss: GnssTable = GnssTable()
    estimator: EstimatorTable = EstimatorTable()
    guidance: GuidanceTable = GuidanceTable()
    reference: ReferenceTable = ReferenceTable()
    autopilot: AutopilotTable = AutopilotTable()
    speed: SpeedTable = SpeedTable()
    station: StationTable = StationTable()
    positioning: PositioningTable = PositioningTable()
    route: RouteTable = RouteTable()
    orders: tuple[OrderTable, ...] = ()
    manoeuvre: str | None = None

    def instruments(self) -> dict[str, InstrumentTable]:
        """Tables of the instruments fitted in addition to the receiver, by name."""
        return {name: getattr(self, name) for name in INSTRUMENTS if getattr(self, name) is not None}

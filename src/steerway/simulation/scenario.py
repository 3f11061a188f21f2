"""The keys of a scenario: everything a simulation needs.

Keys are SI; angles are in degrees and their keys end in `_deg`. Every key has a default. Vessels, instruments, guidance
laws and reference filters declare their own keys, in their own files.
"""

from functools import cached_property
from typing import Annotated, Any, Literal

from pydantic import Field, create_model

from steerway.core.reference import ReferenceTable
from steerway.core.settings import NotNegative, Number, Positive, Table, in_radians
from steerway.estimation.estimator_tables import HeadingEstimatorTable, SpeedEstimatorTable
from steerway.estimation.vessel.aids import AIDS
from steerway.guidance.laws import GuidanceTable
from steerway.guidance.ordered import OrderTable
from steerway.guidance.route_table import OriginTable, RouteKeys, StayWaypointTable
from steerway.sensors.gnss import GnssTable
from steerway.sensors.instrument import InstrumentTable
from steerway.sensors.kinds import INSTRUMENTS
from steerway.simulation.positioning import KINDS as POSITIONING_KINDS
from steerway.simulation.positioning import PositioningEstimatorTable, PositioningTable
from steerway.vessels.environment import Current, Environment, Waves, Wind
from steerway.vessels.kinds import TABLES, AnyVesselTable


class StartTable(Table):
    """The initial state: m from the origin; speed through the water, by default the vessel's own or 0."""

    north: Annotated[Number, "m"] = 0.0
    east: Annotated[Number, "m"] = 0.0
    heading_deg: Number = 0.0
    speed: Annotated[NotNegative | None, "m/s"] = None


class CurrentTable(Table):
    """A current towards `direction_deg`; `std`, `time_constant`: 1σ and time of its Gauss–Markov variation."""

    speed: Annotated[float, Field(strict=True, ge=0.0, le=10.0), "m/s"] = 0.0
    direction_deg: Number = 0.0
    std: Annotated[NotNegative, "m/s"] = 0.0
    time_constant: Annotated[Positive, "s"] = 600.0


class WindTable(Table):
    """Wind from `direction_deg`, with Gauss–Markov gusts; it pushes on `drag_area`, `arm` m ahead of the origin."""

    speed: Annotated[float, Field(strict=True, ge=0.0, le=80.0), "m/s"] = 0.0
    direction_deg: Number = 0.0
    drag_area: Annotated[NotNegative, "m²"] = 0.4
    gust_std: Annotated[NotNegative, "m/s"] = 0.0
    gust_time: Annotated[Positive, "s"] = 10.0
    arm: Annotated[Number, "m"] = 0.0


class WavesTable(Table):
    """Wave motion along `direction_deg` about `frequency`, roll and pitch, and a slow drift force."""

    direction_deg: Number = 0.0
    frequency: Annotated[Positive, "rad/s"] = 1.2
    damping: Annotated[float, Field(strict=True, gt=0.0, lt=1.0), "1"] = 0.1
    displacement_std: Annotated[NotNegative, "m"] = 0.0
    roll_std_deg: NotNegative = 0.0
    pitch_std_deg: NotNegative = 0.0
    drift: Annotated[Number, "N"] = 0.0
    drift_std: Annotated[NotNegative, "N"] = 0.0
    drift_time: Annotated[Positive, "s"] = 60.0


class EnvironmentTable(Table):
    """Current, wind, waves, and a constant `force` (north, east) and `moment`, with Gauss–Markov variations of 1σ
    `force_std` and `moment_std` and time constant `force_time`.
    """

    current: CurrentTable = CurrentTable()
    wind: WindTable = WindTable()
    waves: WavesTable = WavesTable()
    force: Annotated[tuple[Number, Number], "N"] = (0.0, 0.0)
    moment: Annotated[Number, "N·m"] = 0.0
    force_std: Annotated[tuple[NotNegative, NotNegative], "N"] = (0.0, 0.0)
    moment_std: Annotated[NotNegative, "N·m"] = 0.0
    force_time: Annotated[Positive, "s"] = 50.0

    def build(self) -> Environment:
        """The environment, its angles in rad."""
        current, wind, waves = (in_radians(each) for each in (self.current, self.wind, self.waves))
        varying = (*self.force_std, self.moment_std)
        known = Current(**current), Wind(**wind), Waves(**waves), self.force, self.moment
        return Environment(*known, varying, self.force_time)


class EstimatorTable(Table):
    """The filter in the loop; with "truth" the pilot uses the true motion.

    "steering" also uses the orders, and estimates heading, current and the boat's response. "vessel-filter", "tekf" and
    "passive-observer" use the vessel's forces: for dynamic positioning. `profile`: a built-in name or a .toml file; by
    default, the vessel's motion with the errors of the simulated receiver.
    """

    kind: Literal["five-state", "steering", "truth", *POSITIONING_KINDS] = "five-state"  # type: ignore[valid-type]
    profile: str | None = None
    aid: tuple[Literal[*AIDS], ...] = ()  # type: ignore[valid-type]
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

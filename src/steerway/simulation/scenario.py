"""The keys of a scenario: everything a simulation needs.

Keys are SI; angles are in degrees and their keys end in `_deg`. Whatever is left out has a default that works.
"""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from steerway.guidance.laws import LAWS

Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Number = Annotated[float, Field(allow_inf_nan=False)]
Triple = tuple[Number, Number, Number]


class Table(BaseModel):
    """A table of the file."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class VesselTable(Table):
    """Who sails. The Otter alone takes payload, edition and propeller lag, a Nomoto vessel her gain, time and speed."""

    kind: Literal["otter", "mariner", "nomoto"] = "otter"
    method: Literal["rk4", "euler"] = "rk4"
    payload_mass: Annotated[float, Field(ge=0.0, le=45.0)] = 25.0
    payload_position: Triple = (0.05, 0.0, -0.35)
    edition: Literal["today", "2021"] = "today"
    propeller_lag: NotNegative = 0.1
    cruise_speed: Positive = 7.7175
    gain: Positive = 0.2
    time_constant: Positive = 20.0
    speed: Positive = 2.0
    rudder_limit_deg: Annotated[float, Field(gt=0.0, le=90.0)] = 35.0


class StartTable(Table):
    """Where she begins: m from the origin, and speed through the water (by default the vessel's own, or none)."""

    north: Number = 0.0
    east: Number = 0.0
    heading_deg: Number = 0.0
    speed: NotNegative | None = None


class CurrentTable(Table):
    """Towards `direction_deg`; `std` of its wandering over `time_constant`."""

    speed: Annotated[float, Field(ge=0.0, le=10.0)] = 0.0
    direction_deg: Number = 0.0
    std: NotNegative = 0.0
    time_constant: Positive = 600.0


class WindTable(Table):
    """From `direction_deg`; pushes on `drag_area` m²."""

    speed: Annotated[float, Field(ge=0.0, le=80.0)] = 0.0
    direction_deg: Number = 0.0
    drag_area: NotNegative = 0.4
    gust_std: NotNegative = 0.0
    gust_time: Positive = 10.0
    arm: Number = 0.0


class WavesTable(Table):
    """Motion to and fro along `direction_deg`, and a slow drift force."""

    direction_deg: Number = 0.0
    frequency: Positive = 1.2
    damping: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.1
    displacement_std: NotNegative = 0.0
    roll_std_deg: NotNegative = 0.0
    pitch_std_deg: NotNegative = 0.0
    drift: Number = 0.0
    drift_std: NotNegative = 0.0
    drift_time: Positive = 60.0


class EnvironmentTable(Table):
    """Current, wind, waves, and a constant force (north, east) in N."""

    current: CurrentTable = CurrentTable()
    wind: WindTable = WindTable()
    waves: WavesTable = WavesTable()
    force: tuple[Number, Number] = (0.0, 0.0)
    moment: Number = 0.0


class FaultTable(Table):
    """What goes wrong with fixes, at `start` s or `per_hour` times."""

    kind: Literal["dropout", "jump", "burst", "step", "frozen"]
    start: NotNegative | None = None
    per_hour: NotNegative | None = None
    duration: NotNegative | None = None
    size: NotNegative = 0.0
    direction_deg: Number | None = None


class GnssTable(Table):
    """The receiver: `white` and `markov` ([1σ in m, time constant in s] each) of north and of east.

    By default a small receiver's errors: 1.5 m over 300 s, 0.25 m over 5 s and 0.05 m white.
    """

    rate: Annotated[float, Field(gt=0.0, le=1000.0)] = 5.0
    white: NotNegative = 0.05
    markov: tuple[tuple[NotNegative, Positive], ...] = ((1.5, 300.0), (0.25, 5.0))
    settled: bool = True
    latency: Annotated[float, Field(ge=0.0, le=60.0)] = 0.0
    lever_arm: Triple = (0.0, 0.0, 0.0)
    velocity_std: NotNegative | None = None
    faults: tuple[FaultTable, ...] = ()


class CompassTable(Table):
    """A compass; `deviation_deg` are the coefficients A to E of its deviation card."""

    rate: Annotated[float, Field(gt=0.0, le=1000.0)] = 10.0
    std_deg: NotNegative = 0.5
    bias_deg: Number = 0.0
    deviation_deg: tuple[Number, Number, Number, Number, Number] = (0.0, 0.0, 0.0, 0.0, 0.0)


class GyroTable(Table):
    """A yaw-rate gyro."""

    rate: Annotated[float, Field(gt=0.0, le=1000.0)] = 50.0
    noise_density_deg: NotNegative = 0.005
    turn_on_deg: NotNegative = 0.5
    in_run_deg_hour: NotNegative = 10.0


class LogTable(Table):
    """A log of the speed through the water."""

    rate: Annotated[float, Field(gt=0.0, le=1000.0)] = 5.0
    std: NotNegative = 0.05
    bias: Number = 0.0


class EstimatorTable(Table):
    """The filter in the loop; "truth" shows the pilot the true motion instead. `profile`: built in, or a .toml file."""

    kind: Literal["five-state", "truth"] = "five-state"
    profile: str | None = None
    aid: tuple[Literal["sog", "cog", "heading", "water_speed", "yaw_rate"], ...] = ()


class GuidanceTable(Table):
    """The law; the integral and the adaptive one steer by heading, the others by `steer_by`."""

    law: Literal[*LAWS] = "line-of-sight"  # type: ignore[valid-type]
    steer_by: Literal["course", "heading"] | None = None
    lookahead: Positive | None = None
    integral_gain: NotNegative | None = None
    adaptive_gain: NotNegative | None = None
    approach_deg: Annotated[float, Field(gt=0.0, le=90.0)] = 90.0


class ReferenceTable(Table):
    """What the command goes through before the autopilot sees it."""

    kind: Literal["tracking", "model", "low-pass"] | None = None
    bandwidth: Positive | None = None
    damping: Positive = 1.0
    time_constant: Positive = 40.0
    max_rate_deg: Positive = 15.0


class AutopilotTable(Table):
    """Pole placement on a Nomoto vessel; by default the boat's own numbers."""

    bandwidth: Positive | None = None
    damping: Positive | None = None
    nomoto_gain: Positive | None = None
    nomoto_time: Positive | None = None


class SpeedTable(Table):
    """Speed over ground to sail at where the waypoints do not say, and the bandwidth of its loop."""

    cruise: NotNegative | None = None
    bandwidth: Positive | None = None


class StationTable(Table):
    """Station keeping."""

    bandwidth: Positive = 0.2
    radius: Positive = 5.0


class WaypointTable(Table):
    """A waypoint, in m from the origin or as latitude and longitude; `stay` s of station keeping before going on."""

    north: Number | None = None
    east: Number | None = None
    latitude_deg: Annotated[float, Field(ge=-89.0, le=89.0)] | None = None
    longitude_deg: Annotated[float, Field(ge=-180.0, le=180.0)] | None = None
    speed: NotNegative | None = None
    acceptance: Positive | None = None
    stay: NotNegative = 0.0


class RouteTable(Table):
    """The waypoints, and what happens at the end."""

    waypoints: tuple[WaypointTable, ...] = Field(min_length=2, description="at least 2 waypoints")
    at_end: Literal["stop", "hold", "continue"] = "stop"
    passing: Literal["remaining", "circle"] = "remaining"
    acceptance: Positive | None = None


class OriginTable(Table):
    """Where north = east = 0 lies, for logs and for waypoints in latitude and longitude."""

    latitude_deg: Annotated[float, Field(ge=-89.0, le=89.0)] = 63.44
    longitude_deg: Annotated[float, Field(ge=-180.0, le=180.0)] = 10.40


class Scenario(Table):
    """A scenario; `reading` reads one, `assembly` makes a vessel, a sea, instruments and a pilot of it."""

    name: str = "simulation"
    description: str = ""
    duration: Annotated[float, Field(gt=0.0, le=1e7)] = 600.0
    step: Annotated[float, Field(gt=0.0, le=10.0)] = 0.02
    seed: Annotated[int, Field(ge=0)] = 1
    begins: str = "2026-06-01T12:00:00Z"  # of the logs that are written
    origin: OriginTable = OriginTable()
    vessel: VesselTable = VesselTable()
    start: StartTable = StartTable()
    environment: EnvironmentTable = EnvironmentTable()
    gnss: GnssTable = GnssTable()
    compass: CompassTable | None = None
    gyro: GyroTable | None = None
    log: LogTable | None = None
    estimator: EstimatorTable = EstimatorTable()
    guidance: GuidanceTable = GuidanceTable()
    reference: ReferenceTable = ReferenceTable()
    autopilot: AutopilotTable = AutopilotTable()
    speed: SpeedTable = SpeedTable()
    station: StationTable = StationTable()
    route: RouteTable = Field(description="a table [route] with waypoints")

"""Names for this package's tests; not part of the public API."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway_studies import at_sea, named, otter_course, unseen_logs
    from steerway_studies.adaptive_speed import printed, sailing
    from steerway_studies.adaptive_speed.cases import Job, run
    from steerway_studies.at_sea.sailing import CRAFT, SHARES, SHIP_LENGTH, Case, Receiver, all_cases, drawn
    from steerway_studies.at_sea.sailing import judged as sailing_judged
    from steerway_studies.cybership_observers import observers, scenario
    from steerway_studies.cybership_observers.observers import TUNED_GAINS
    from steerway_studies.estimator_limits import BOUNDS, CELLS, bounded, errors, over_runs
    from steerway_studies.estimator_limits import judged as limits_judged
    from steerway_studies.estimator_limits.bound import FAST, SLOW, TrueMotion, filtering_bound, smoothing_bound
    from steerway_studies.estimator_limits.bound import sail as scenarios_sail
    from steerway_studies.mariner_los import ship
    from steerway_studies.mariner_los.ship import ShipCase
    from steerway_studies.otter_course import logs
    from steerway_studies.otter_course.boat import as_published, turned
    from steerway_studies.otter_course.logs import LOGS, as_printed
    from steerway_studies.papers import course_autopilot
    from steerway_studies.papers.course_autopilot import RangeRatePassing
    from steerway_studies.papers.ekf_5states import Ekf5States, ekf_5states
    from steerway_studies.papers.heading import PrintedCompassKalman
    from steerway_studies.papers.interval_filter import PrintedIntervalFilter
    from steerway_studies.papers.speed import PrintedMrac, PrintedSpeedEkf
    from steerway_studies.springer_mission.missions import ideal, nominal
    from steerway_studies.springer_mission.training import lesson, train
    from steerway_studies.springer_mission.world import PAPER_CIRCUIT, World, autopilot_parts, paper_mpc
    from steerway_studies.springer_mission.world import sail as world_sail
    from steerway_studies.study import Quantity, Results, Study, judged, keeping, means, over_cases, reached
    from steerway_studies.unseen_logs import catalogue, plain_ekf, rounded
    from steerway_studies.unseen_logs.reference import VelocityReference, rate_lag, velocity_lag

__getattr__, __dir__ = on_demand(__name__)

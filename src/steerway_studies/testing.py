"""Names that the tests of this package need and no user does."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway_studies import at_sea, low_speed, mariner_los, named, otter_course, otter_path, real_logs, unseen_logs
    from steerway_studies.adaptive_speed import cases, judge, plants, printed, theory
    from steerway_studies.adaptive_speed import perturbed as adaptive_speed_perturbed
    from steerway_studies.adaptive_speed.cases import Job, run
    from steerway_studies.ais_prediction import CHI_SQUARE, LOG, judged_predictions
    from steerway_studies.at_sea.cases import CRAFT, SHARES, Case, Receiver, ablations, all_cases, drawn
    from steerway_studies.at_sea.sailing import judged as sailing_judged
    from steerway_studies.cybership_observers import contestants, positioning, scenario, trials, tuning
    from steerway_studies.cybership_observers.contestants import TUNED_GAINS
    from steerway_studies.cybership_observers.scenario import PRINTED_GAINS
    from steerway_studies.estimator_limits import (
        accuracy,
        aided,
        consistency,
        correlated,
        held,
        known_modes,
        unknown_modes,
    )
    from steerway_studies.estimator_limits.aided import GYRO_BIAS, GYRO_STD, PROFILE, VELOCITY_STD, aided_fixes
    from steerway_studies.estimator_limits.bound import filtering_bound, smoothing_bound
    from steerway_studies.estimator_limits.cells import CELLS, WHAT, WHERE, bounded, sums
    from steerway_studies.estimator_limits.cells import judged as cells_judged
    from steerway_studies.estimator_limits.histories import _forward, all_histories, known_mode_smoother
    from steerway_studies.estimator_limits.particles import begun, in_plane, particle_filter, steps
    from steerway_studies.estimator_limits.scenarios import FAST, SLOW, TrueMotion, straight_and_turning
    from steerway_studies.estimator_limits.scenarios import sail as scenarios_sail
    from steerway_studies.estimator_limits.statistics import error_squares, errors, over_runs
    from steerway_studies.estimator_limits.troubles import BEGIN, TROUBLES, standstill
    from steerway_studies.mariner_los import ship
    from steerway_studies.mariner_los.lyapunov import LOOKAHEAD as LYAPUNOV_LOOKAHEAD
    from steerway_studies.mariner_los.lyapunov import approaches, promised
    from steerway_studies.mariner_los.ship import (
        PRINTED_NOISE,
        STATED_NOISE,
        ShipCase,
        cross_track,
        measured,
        receiver,
        straight,
    )
    from steerway_studies.otter_course import comparisons, logs
    from steerway_studies.otter_course.boat import as_published, identified, steered_by_product, zigzag
    from steerway_studies.otter_course.logs import LOGS, as_printed
    from steerway_studies.otter_course.unwinding import turned
    from steerway_studies.otter_path import boat
    from steerway_studies.otter_path.boat import LOOKAHEAD as BOAT_LOOKAHEAD
    from steerway_studies.otter_path.boat import PathCase
    from steerway_studies.papers import otter_allocation, path_following, references
    from steerway_studies.papers.course_autopilot import (
        MARINER_NOMOTO,
        OTTER_NOMOTO,
        OTTER_PRINTED_GAINS,
        closed_loop_poles,
        feedforward,
        rudder,
    )
    from steerway_studies.papers.ekf_5states import Ekf5States, ekf_5states
    from steerway_studies.papers.interval_filter import PrintedIntervalFilter
    from steerway_studies.papers.otter_allocation import propeller_speeds
    from steerway_studies.papers.output_corrected_mpc import OutputCorrectedMpc
    from steerway_studies.papers.path_following import RangeRateTest, along_track, switches
    from steerway_studies.papers.positioning import PrintedPositionPID
    from steerway_studies.papers.range_rate import RangeRatePassing
    from steerway_studies.papers.references import los_observer, reference_model
    from steerway_studies.papers.speed_ekf import PrintedSpeedEkf
    from steerway_studies.papers.speed_mrac import PrintedMrac
    from steerway_studies.parts import keeping, over_cases
    from steerway_studies.springer_mission.h_infinity import HInfinityFilter, exists
    from steerway_studies.springer_mission.missions import alarm_mission
    from steerway_studies.springer_mission.navigators import WeightedBounds, ideal, interval_box, nominal
    from steerway_studies.springer_mission.rigour import rigour
    from steerway_studies.springer_mission.training import lesson, train
    from steerway_studies.springer_mission.world import (
        PAPER_CIRCUIT,
        World,
        autopilot_parts,
        ideal_path,
        paper_mpc,
        replayed,
    )
    from steerway_studies.springer_mission.world import sail as world_sail
    from steerway_studies.study import Results, Study
    from steerway_studies.unseen_logs import catalogue, plain_ekf, prediction, recordings, summarise
    from steerway_studies.unseen_logs.alignment import rate_lag, velocity_lag
    from steerway_studies.unseen_logs.catalogue import KNOWN
    from steerway_studies.unseen_logs.contestants import DEFAULT, EKF, difference, of_motion
    from steerway_studies.unseen_logs.judging import judged_rows, right_refused, verdict
    from steerway_studies.unseen_logs.recordings import JudgedLog, heading_rate, opened, plane
    from steerway_studies.unseen_logs.reference import VelocityReference

__getattr__, __dir__ = on_demand(__name__)

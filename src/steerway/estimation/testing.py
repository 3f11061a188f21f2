"""Names for this package's tests; not part of the public API."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.core.gaps import LONGEST_GAP
    from steerway.core.kalman import Fix, correct, innovation, normalised_square, place_by_fix
    from steerway.estimation.aboard import AtFaceValue, FilterEstimator, HeadingTracker
    from steerway.estimation.estimator_tables import HeadingEstimatorTable
    from steerway.estimation.filter import five_state
    from steerway.estimation.filter import voyages as inference_forecast
    from steerway.estimation.filter.bank import advance
    from steerway.estimation.filter.bank import start as bank_start
    from steerway.estimation.filter.cells import cell_of, interval_of, step_density
    from steerway.estimation.filter.discrete import noise, taken_up
    from steerway.estimation.filter.fuse import QUICK_SPEED, QUICK_SPEED_TIME
    from steerway.estimation.filter.model import COURSE, FUSED, SPEED, room_to_keep
    from steerway.estimation.filter.model import empty_bank as model_empty_bank
    from steerway.estimation.filter.reversal import reversal_of
    from steerway.estimation.filter.row import Asked, Rows, run_record
    from steerway.estimation.filter.vectors import Sym2, Vec2
    from steerway.estimation.filter.weigh import take_fix
    from steerway.estimation.fit import tune
    from steerway.estimation.fit.auto_aids import velocity_of
    from steerway.estimation.fit.selection import infer
    from steerway.estimation.heading.aboard import HeadingAboard
    from steerway.estimation.heading.aboard import model_of as heading_model_of
    from steerway.estimation.heading.aided import PRODUCT
    from steerway.estimation.heading.interval import arithmetic
    from steerway.estimation.heading.model_bank import gain_range
    from steerway.estimation.log import run as whole_log
    from steerway.estimation.log.accuracy import variance_scales_of
    from steerway.estimation.log.compare import compare
    from steerway.estimation.log.copies import without_copies
    from steerway.estimation.log.course import RATE
    from steerway.estimation.log.latency import lateness, on_time
    from steerway.estimation.log.plane import laid_out
    from steerway.estimation.log.record import extrapolated, of_other_receiver
    from steerway.estimation.log.run import Track, motion_of
    from steerway.estimation.log.stamps import regular_times
    from steerway.estimation.log_estimate import LogEstimator
    from steerway.estimation.positioning import low_speed
    from steerway.estimation.vessel.flat import model_of_profile
    from steerway.estimation.vessel.profile import BUILT_IN, prior_profile
    from steerway.estimation.vessel.structures import MODES, Structure, medians_of, model_of

__getattr__, __dir__ = on_demand(__name__)

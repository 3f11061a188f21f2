"""Whatever instruments report, in any order: speed controllers, fused speed and heading stay numbers or say unknown."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from steerway.control import AdaptiveSpeed, AdaptiveSpeedGains, ObservedSpeed, SpeedObserverGains
from steerway.estimation.heading import AidedHeadingFilter
from steerway.estimation.heading.testing import TICK, HeadingAboard, model_of
from steerway.live.testing import InputRow, MeasuredSpeed

NAN = st.just(math.nan)
SPEED = st.one_of(NAN, st.floats(-30.0, 30.0))
FEW = settings(max_examples=25, deadline=None)


@FEW
@given(
    st.sampled_from([(AdaptiveSpeed, AdaptiveSpeedGains), (ObservedSpeed, SpeedObserverGains)]),
    st.lists(st.tuples(SPEED, SPEED, st.one_of(NAN, st.floats(-50.0, 50.0)), st.floats(0.001, 5.0)), max_size=40),
)
def test_speed_controllers_command_within_the_limits(kind, steps):
    controller, gains = kind
    control = controller(gains(low=-5.0))
    for setpoint, speed, shaft, dt in steps:
        command = control.step(0.0 if math.isnan(setpoint) else setpoint, speed, dt, shaft)
        assert -5.0 <= command <= 17.5


ROW = st.builds(
    lambda time, **read: InputRow("any", time, **read),
    st.floats(-100.0, 1000.0),
    sog=SPEED,
    bottom_speed=SPEED,
    water_speed=SPEED,
    acceleration=st.one_of(NAN, st.floats(-50.0, 50.0)),
    shaft=SPEED,
)


@FEW
@given(st.lists(ROW, max_size=60))
def test_a_fused_speed_is_a_number_with_its_deviation(rows):
    measured = MeasuredSpeed()
    for row in rows:
        measured.take(row)
    assert math.isfinite(measured.fusion.speed) and measured.fusion.speed_std >= 0.0
    assert math.isfinite(measured.fusion.filter.log_scale_std)


READINGS = st.lists(st.one_of(NAN, st.floats(-7.0, 7.0)), max_size=90)
VELOCITY = st.tuples(SPEED, SPEED)


@FEW
@given(st.lists(st.tuples(READINGS, VELOCITY, st.sampled_from([0.02, 0.5, 1.0, 2.5])), min_size=1, max_size=5))
def test_a_heading_sought_all_round_is_known_with_its_deviation_or_unknown(steps):
    estimator = AidedHeadingFilter(heading=None)
    for readings, velocity, dt in steps:
        heading = estimator.step(1.0, readings, velocity, dt)
        nothing = not np.isfinite(readings).any() and not np.isfinite(velocity).all()
        assert math.isfinite(heading) or nothing or dt < TICK, "a reading waits for its tick"
        assert math.isfinite(estimator.heading_std) and math.isfinite(estimator.heading_for(1.0))


@FEW
@given(
    st.sampled_from(["aided", "composite"]), st.lists(st.tuples(SPEED, VELOCITY, st.floats(0.001, 3.0)), max_size=20)
)
def test_heading_aboard_is_an_angle_or_unknown(kind, steps):
    aboard = HeadingAboard(kind, model_of((1.0, 0.9), (0.02, -0.02), 0.1, 0.5), 0.5, 2.0)
    for heading, velocity, dt in steps:
        aboard.order(0.3)
        angle, rate = aboard.step(heading, dt, velocity)
        assert math.isnan(angle) == math.isnan(rate)
        assert math.isnan(angle) or -math.pi <= angle < math.pi + 1e-12

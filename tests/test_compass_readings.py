"""Any number, rate, order and gap of compass readings, and any step: a heading with its deviation or one sentence."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from steerway.core import InputError
from steerway.estimation.heading import (
    AidedHeadingFilter,
    CompositeFilter,
    IntervalFilter,
    LearnedHeading,
    ModelBank,
    box_of,
    composite_model,
    corners,
)
from steerway.sensors import TCM2
from steerway_studies.testing import HInfinityFilter, PrintedIntervalFilter
from tests.weaving import record

MODEL = composite_model()
FILTERS = {
    "composite": lambda: CompositeFilter(MODEL),
    "bank": lambda: ModelBank(corners(0.01)),
    "h_infinity": lambda: HInfinityFilter(MODEL, 1e-3),
    "aided": AidedHeadingFilter,
    "learned": LearnedHeading,
    "interval": lambda: IntervalFilter(box_of(MODEL, 0.005)),
}
ANYTHING = st.floats(allow_nan=True, allow_infinity=True)
PLAUSIBLE = st.one_of(st.floats(-20.0, 20.0), st.just(math.nan))
READINGS = st.one_of(
    st.none(),
    arrays(np.float64, st.integers(0, 130), elements=PLAUSIBLE),
    arrays(np.float64, st.integers(0, 60), elements=ANYTHING),
    arrays(np.float64, (2, 20), elements=PLAUSIBLE),
    st.just(["north"]),
)


def one_sentence(problem: InputError) -> bool:
    text = str(problem)
    return text.startswith(("heading.", "h_infinity.")) and "expected" in text and "\n" not in text


@pytest.mark.parametrize("make", FILTERS.values(), ids=FILTERS)
@settings(max_examples=15, deadline=None)
@given(st.data())
def test_any_readings_give_a_heading_with_its_deviation_or_one_sentence(make, data):
    estimator = make()
    for _ in range(data.draw(st.integers(1, 4))):
        readings = data.draw(READINGS)
        number = 0 if readings is None else len(readings)
        dt = data.draw(st.one_of(st.sampled_from([1.0, 0.02, 0.5, 2.5]), ANYTHING))
        inside = st.floats(0.0, dt) if 0.0 < dt < 1e3 else st.just(0.0)
        times = data.draw(
            st.one_of(
                st.none(),
                arrays(np.float64, number, elements=st.one_of(inside, st.just(math.nan))),
                arrays(np.float64, st.integers(0, 60), elements=ANYTHING),
            )
        )
        difference = data.draw(st.one_of(st.floats(-30.0, 30.0), ANYTHING))
        try:
            estimator.step(difference, readings, dt=dt, times=times)
        except InputError as problem:
            assert one_sentence(problem)
    if isinstance(estimator, IntervalFilter):
        assert estimator.diverged or -math.inf < estimator.low <= estimator.high < math.inf
    else:
        assert math.isfinite(estimator.heading)
        assert isinstance(estimator, LearnedHeading) or 0.0 <= estimator.heading_std < math.inf


@pytest.mark.parametrize("make", FILTERS.values(), ids=FILTERS)
def test_what_is_refused_changes_nothing(make):
    differences, readings, _, _ = record(6)
    one, other = make(), make()
    for u, z in zip(differences, readings, strict=True):
        for wrong in ({"readings": np.full(3, 1e9)}, {"dt": 0.0}, {"readings": z, "times": np.full(40, 1.5)}):
            with pytest.raises(InputError, match="heading"):
                one.step(u, **wrong)
        with pytest.raises(InputError, match=r"heading\.difference is nan"):
            one.step(math.nan, z)
        assert one.step(u, z) == other.step(u, z)


@pytest.mark.parametrize(("step", "rate"), [(0.1, 40), (0.02, 10), (3.0, 7), (1.0, 160)])
def test_other_steps_and_rates_estimate_the_same_heading(step, rate):
    """Held against the filter of P4's 40 readings a second; the input changes every 30 s, so that any step holds it."""
    rng = np.random.default_rng(2)
    compass_gain, seconds = TCM2.gain, 120
    differences = np.repeat([3.0, -2.0, 1.0, -4.0], 30)
    usual, headings = CompositeFilter(MODEL), [0.0]
    plant = CompositeFilter(MODEL)
    for u in differences:
        headings.append(plant.step(u))  # without readings the filter is its vehicle model
    for k, u in enumerate(differences):
        usual.step(u, compass_gain * headings[k] + 0.02 * rng.standard_normal(40))
    other = CompositeFilter(MODEL)
    for k in range(round(seconds / step)):
        begin = k * step
        n = round(step * rate * (k + 1)) - round(step * rate * k)
        times = np.sort(rng.uniform(0.0, step, n))
        truth = np.interp(begin + times, np.arange(seconds + 1), headings)
        other.step(
            differences[int(begin + 1e-9)], compass_gain * truth + 0.02 * rng.standard_normal(n), dt=step, times=times
        )
    assert usual.heading == pytest.approx(headings[-1], abs=math.radians(0.1))
    assert other.heading == pytest.approx(headings[-1], abs=math.radians(0.1))


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: CompositeFilter(np.zeros(13)),
        lambda: CompositeFilter(np.full(14, np.nan)),
        lambda: HInfinityFilter(np.zeros((14, 2)), 0.0),
        lambda: ModelBank([]),
        lambda: IntervalFilter(np.zeros((14, 3))),
        lambda: IntervalFilter(box_of(MODEL, 0.01)[:, ::-1]),
        lambda: IntervalFilter(np.stack([MODEL - 1e-6, MODEL + 1e-6], axis=1)),
        lambda: IntervalFilter(box_of(MODEL, 0.01), parts=0),
        lambda: PrintedIntervalFilter(box_of(MODEL, 0.01)).step(0.0, np.zeros(39)),
        lambda: AidedHeadingFilter().step(0.0, velocity=(1.0,)),
    ],
)
def test_mis_shaped_models_are_refused(wrong):
    with pytest.raises(InputError, match="expected"):
        wrong()

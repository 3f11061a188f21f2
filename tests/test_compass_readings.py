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
    Ticks,
    box_of,
    composite_model,
    corners,
)
from steerway.sensors import TCM2, random_compass
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
@settings(max_examples=40, deadline=None)
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


@pytest.mark.parametrize("make", FILTERS.values(), ids=FILTERS)
def test_readings_go_to_the_ticks_of_their_times(make):
    """In any order, with gaps for NaN: the same as 40 readings of which some are unknown."""
    rng = np.random.default_rng(1)
    differences, readings, _, _ = record(8)
    one, other = make(), make()
    for u, z in zip(differences, readings, strict=True):
        chosen = rng.permutation(40)[: rng.integers(0, 40)]
        some = np.full(40, np.nan)
        some[chosen] = z[chosen]
        times = (chosen + 1) * 0.025 + rng.uniform(-0.012, 0.0, len(chosen))
        assert np.array_equal(one.step(u, some), other.step(u, z[chosen], times=times), equal_nan=True)


def test_tables_of_readings():
    ticks = Ticks()
    ((part, table),) = ticks.parts(0.1, np.radians([30.0, 10.0, np.nan, 20.0]), [0.1, 0.05, 0.06, 0.051])
    assert part == 0.1
    np.testing.assert_allclose(table[0], [np.nan, 15.0, np.nan, 30.0])
    np.testing.assert_array_equal(table[1], [0.0, 2.0, 0.0, 1.0])
    ((_, table),) = ticks.parts(0.01, [0.5])
    assert table.shape == (2, 0), "no tick is due: the reading waits"
    ((_, table),) = ticks.parts(0.02, None)
    np.testing.assert_allclose(table, [[math.degrees(0.5)], [1.0]])
    parts = list(Ticks().parts(2.5, np.zeros(25)))
    assert [part for part, _ in parts] == [2.5 / 3.0] * 3
    np.testing.assert_array_equal(np.hstack([table for _, table in parts])[1], np.tile([0.0, 0.0, 0.0, 1.0], 25))
    assert sum(next(Ticks().parts(1.0, np.zeros(100)))[1][1]) == 100.0


@pytest.mark.parametrize(("step", "rate"), [(0.1, 40), (0.5, 40), (0.02, 10), (2.0, 40), (3.0, 7), (1.0, 160)])
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


def test_without_input_any_split_of_time_gives_one_covariance():
    """Vehicle noise grows with time, so that a rate of steps changes no tuning."""
    whole, split = CompositeFilter(MODEL), CompositeFilter(MODEL)
    for _ in range(60):
        whole.step(0.0, dt=1.0)
    for _ in range(240):
        split.step(0.0, dt=0.25)
    assert split.heading_std == pytest.approx(whole.heading_std, rel=2e-3)


def test_with_a_point_for_a_box_gaps_leave_the_ordinary_filter():
    rng = np.random.default_rng(3)
    differences, readings, _, _ = record(10)
    bounds, own = IntervalFilter(box_of(MODEL, 0.0)), CompositeFilter(MODEL)
    for u, z in zip(differences, readings, strict=True):
        z = np.where(rng.random(40) < 0.3, z, np.nan)
        low, high = bounds.step(u, z)
        assert low <= own.step(u, z) + 1e-15 and own.heading - 1e-15 <= high
    assert bounds.width < 1e-9


def test_bounds_hold_every_filter_at_any_rate_and_step():
    rng = np.random.default_rng(4)
    tolerance = 0.005
    bounds = IntervalFilter(box_of(MODEL, tolerance))
    members = [CompositeFilter(composite_model(random_compass(rng, tolerance))) for _ in range(30)]
    differences, readings, _, _ = record(60)
    for k, (u, z) in enumerate(zip(differences, readings, strict=True)):
        dt = (1.0, 0.6, 1.4)[k % 3]
        chosen = np.sort(rng.permutation(40)[: rng.integers(0, 41)])
        times = dt / 40.0 * (chosen + 1)
        low, high = bounds.step(u, z[chosen], dt=dt, times=times)
        for each in members:
            assert low <= each.step(u, z[chosen], dt=dt, times=times) <= high
    assert not bounds.diverged and bounds.width < math.radians(20.0)


def test_a_long_gap_of_readings_widens_every_deviation():
    for make in (FILTERS["composite"], FILTERS["bank"], FILTERS["aided"], FILTERS["h_infinity"]):
        estimator = make()
        for z in record(5)[1]:
            estimator.step(0.0, z)
        before = estimator.heading_std
        estimator.step(0.0, dt=60.0)
        assert estimator.heading_std > before
    assert math.isnan(CompositeFilter(MODEL).nis)


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

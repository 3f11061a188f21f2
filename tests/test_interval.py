"""Interval arithmetic and filters: rigour against 400-bit numbers, inclusion of every model, widths, divergence."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from steerway.core import InputError
from steerway.estimation.heading import (
    CompositeFilter,
    DeviationBounds,
    Features,
    IntervalFilter,
    Network,
    box_of,
    composite_model,
    ideal_weight,
    weighted,
)
from steerway.estimation.heading.testing import arithmetic, sub_boxes
from steerway.sensors import TCM2, TRUE_TCM2, CompassModel, random_compass
from steerway.vessels import HeadingModel
from steerway.vessels.testing import PAPER_YAW, PHYSICAL_YAW
from steerway_studies.testing import PrintedIntervalFilter, exact_headings, rigour
from tests.weaving import record

NUMBERS = st.floats(-1e9, 1e9).filter(lambda x: x == 0.0 or abs(x) > 1e-9)
INTERVALS = st.tuples(NUMBERS, NUMBERS).map(lambda pair: (min(pair), max(pair)))


@settings(max_examples=300, deadline=None)
@given(INTERVALS, INTERVALS, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_every_operation_holds_what_exact_numbers_give(a, b, s, t):
    x = min(max(a[0] + s * (a[1] - a[0]), a[0]), a[1])
    y = min(max(b[0] + t * (b[1] - b[0]), b[0]), b[1])
    exact_x, exact_y = Fraction(x), Fraction(y)
    cases = [
        (arithmetic.add(a, b), exact_x + exact_y),
        (arithmetic.subtract(a, b), exact_x - exact_y),
        (arithmetic.multiply(a, b), exact_x * exact_y),
        (arithmetic.scale(x, b), exact_x * exact_y),
        (arithmetic.square(a), exact_x * exact_x),
    ]
    if y != 0.0:
        cases += [(arithmetic.divide(a, b), exact_x / exact_y), (arithmetic.reciprocal(b), 1 / exact_y)]
    for (low, high), exact in cases:
        assert low == -math.inf or Fraction(low) <= exact
        assert high == math.inf or exact <= Fraction(high)
    if x >= 0.0:
        low, high = arithmetic.root(a)
        assert Fraction(low) ** 2 <= exact_x <= Fraction(high) ** 2


def test_division_by_what_holds_zero_says_nothing():
    assert arithmetic.divide((1.0, 2.0), (-1.0, 1.0)) == (-math.inf, math.inf)
    assert arithmetic.reciprocal((0.0, 1.0)) == (-math.inf, math.inf)
    assert not arithmetic.sound((1.0, math.inf)) and not arithmetic.sound((math.nan, 1.0))
    assert not arithmetic.sound(arithmetic.intersect((0.0, 1.0), (2.0, 3.0)))


@pytest.mark.parametrize("interval_filter", [IntervalFilter, PrintedIntervalFilter])
def test_outward_rounding_holds_the_exact_filter_and_plain_doubles_do_not(interval_filter):
    """With a point for a box all width is rounding. Doubles without outward rounding are a point beside the truth."""
    differences, readings, _, _ = record(25)
    held, plain = rigour(differences, readings, interval_filter)
    assert held == 100.0 and plain < 20.0
    bounds = interval_filter(box_of(composite_model(), 0.0))
    for u, z in zip(differences, readings, strict=True):
        bounds.step(u, z)
    assert interval_filter is PrintedIntervalFilter or bounds.width < 1e-6


def test_the_exact_filter_is_the_ordinary_one():
    differences, readings, _, _ = record(5)
    estimator = CompositeFilter(composite_model())
    headings = [estimator.step(u, z) for u, z in zip(differences, readings, strict=True)]
    exact = [float(each) for each in exact_headings(composite_model(), differences, readings)]
    np.testing.assert_allclose(headings, exact, rtol=1e-9, atol=1e-15)


def test_outward_rounding_is_what_holds_a_tenth_and_two():
    """0.1 + 0.2 lies beside the double that the sum rounds to."""
    exact = Fraction(0.1) + Fraction(0.2)
    assert exact != Fraction(0.1 + 0.2)
    low, high = arithmetic.add((0.1, 0.1), (0.2, 0.2))
    assert Fraction(low) < exact < Fraction(high) and high - low < 1e-15


@pytest.mark.parametrize("tolerance, seconds", [(0.001, 120), (0.005, 120), (0.01, 120)])
def test_every_model_in_the_box_is_included(tolerance, seconds):
    differences, readings, _, _ = record(seconds)
    bounds = IntervalFilter(box_of(composite_model(), tolerance))
    rng = np.random.default_rng(8)
    members = [CompositeFilter(composite_model(random_compass(rng, tolerance))) for _ in range(60)]
    members += [CompositeFilter(composite_model(TCM2.scaled(1.0 + s * tolerance))) for s in (-1, 1)]
    for u, z in zip(differences, readings, strict=True):
        low, high = bounds.step(u, z)
        headings = [each.step(u, z) for each in members]
        assert low <= min(headings) and max(headings) <= high
    assert not bounds.diverged
    spread = max(headings) - min(headings)
    assert spread < bounds.width < 60.0 * spread


def test_included_with_sub_boxes_and_a_shift_that_is_uncertain():
    differences, readings, _, _ = record(40)
    whole, parts = (
        IntervalFilter(box_of(composite_model(), 0.01)),
        IntervalFilter(box_of(composite_model(), 0.01), parts=3),
    )
    shifted = IntervalFilter(box_of(composite_model(), 0.005, shift_too=True))
    rng = np.random.default_rng(9)
    members = [CompositeFilter(composite_model(random_compass(rng))) for _ in range(40)]
    true = CompositeFilter(composite_model(TRUE_TCM2))
    for u, z in zip(differences, readings, strict=True):
        for each in (whole, parts, shifted):
            each.step(u, z)
        headings = [each.step(u, z) for each in members]
        assert parts.low <= min(headings) and max(headings) <= parts.high
        if not shifted.diverged:
            assert shifted.low <= true.step(u, z) <= shifted.high
    assert parts.width < 0.5 * whole.width


def test_the_printed_filter_holds_until_it_reports_divergence():
    differences, readings, _, _ = record(20)
    printed, sharp = (
        PrintedIntervalFilter(box_of(composite_model(), 0.01)),
        IntervalFilter(box_of(composite_model(), 0.01)),
    )
    own, lost = CompositeFilter(composite_model(TCM2.scaled(1.005))), None
    for k, (u, z) in enumerate(zip(differences, readings, strict=True)):
        printed.step(u, z)
        sharp.step(u, z)
        truth = own.step(u, z)
        if printed.diverged:
            lost = lost or k
            assert math.isnan(printed.low) and math.isnan(printed.width)
        else:
            assert printed.low <= truth <= printed.high
            wider = printed.width > 3.0 * sharp.width
    assert lost is not None and lost < 15 and wider


def test_erratum_ten_per_cent_diverges_at_once():
    differences, readings, _, _ = record(10)
    for interval_filter in (IntervalFilter, PrintedIntervalFilter):
        bounds = interval_filter(box_of(composite_model(), 0.1, shift_too=True))
        for u, z in zip(differences, readings, strict=True):
            bounds.step(u, z)
        assert bounds.diverged


def test_any_coordinates_are_sound(monkeypatch):
    """The change of variables is exact: poor numbers for it widen the bounds and never break them."""
    from steerway.estimation.heading.testing import sharpened

    differences, readings, _, _ = record(30)
    for frame in ([5.0, 4.0, 1.1, -0.5], [25.0, 24.0, 0.9, -1.0]):
        monkeypatch.setattr(sharpened, "coordinates", lambda box, frame=frame: np.array(frame))
        bounds = IntervalFilter(box_of(composite_model(), 0.005))
        members = [CompositeFilter(composite_model(TCM2.scaled(f))) for f in (0.995, 1.0, 1.005)]
        for u, z in zip(differences, readings, strict=True):
            low, high = bounds.step(u, z)
            assert bounds.diverged or all(low <= each.step(u, z) <= high for each in members)


def test_sub_boxes_are_the_box():
    box = box_of(composite_model(), 0.01)
    boxes = sub_boxes(box, 4)
    assert len(boxes) == 16
    np.testing.assert_array_equal(boxes[:, :, 0].min(axis=0), box[:, 0])
    np.testing.assert_array_equal(boxes[:, :, 1].max(axis=0), box[:, 1])
    area = np.prod(boxes[:, 6:8, 1] - boxes[:, 6:8, 0], axis=1).sum()
    assert area == pytest.approx(np.prod(box[6:8, 1] - box[6:8, 0]))
    assert np.all(box[6:10, 0] <= 0.99 * np.array(TCM2[:4])) and np.all(box[6:10, 1] >= 1.01 * np.array(TCM2[:4]))
    np.testing.assert_array_equal(box[10], 1.0)


def test_unusable_settings_are_named():
    with pytest.raises(InputError, match="tolerance"):
        box_of(composite_model(), -0.1)


@given(st.floats(-1e3, 1e3), st.floats(1e-6, 1e5), st.floats(0.0, 1.0))
def test_erratum_ideal_weight_is_a_tautology(low, width, where):
    """P4 (19)–(20): whatever the bounds and the estimate inside them, the ideal weight gives the estimate back."""
    high = low + width
    ideal = min(max(low + where * width, low), high)
    weight = ideal_weight(low, high, ideal)
    assert 0.0 <= weight <= 1.0
    assert abs(weighted(low, high, weight) - ideal) <= max(1e-6, 1e-12 * width)


def test_features_and_network():
    features = Features()
    for k in range(2000):
        out = features.step(0.5, 90.0 if k >= 1000 else 0.0)
    np.testing.assert_allclose(out[:5], 0.5, rtol=1e-3)
    assert out[5] == pytest.approx(2000 * 0.5 / 200.0)
    np.testing.assert_allclose(out[6:11], 90.0, rtol=0.01)
    rng = np.random.default_rng(1)
    layers = tuple((rng.standard_normal(shape), rng.standard_normal(shape[1])) for shape in ((12, 3), (3, 1)))
    network = Network(np.zeros(12), np.ones(12), layers)
    hidden = np.tanh(out @ layers[0][0] + layers[0][1])
    assert network(out) == pytest.approx(float((hidden @ layers[1][0] + layers[1][1])[0]))


def test_a_network_survives_its_file(tmp_path):
    layers = ((np.ones((12, 2)), np.zeros(2)), (np.full((2, 1), 0.5), np.array([0.25])))
    network = Network(np.zeros(12), np.full(12, 2.0), layers)
    network.save(tmp_path / "n.npz")
    assert Network.load(tmp_path / "n.npz")(np.full(12, 0.1)) == pytest.approx(network(np.full(12, 0.1)), rel=1e-6)


def test_paper_yaw_drives_both():
    assert composite_model()[4] == pytest.approx(np.degrees(PAPER_YAW.outputs[0]))


DEVIATION = math.radians(8.0)
DEVIATIONS = (
    lambda heading, k: (1.0 - 1e-9) * DEVIATION,
    lambda heading, k: -(1.0 - 1e-9) * DEVIATION,
    lambda heading, k: DEVIATION * math.sin(heading),
    lambda heading, k: (1.0 - 1e-9) * DEVIATION * (1.0 if k // 150 % 2 else -1.0),
)


def aboard(yaw, deviation):
    return DeviationBounds(yaw, deviation, math.radians(1.0), math.radians(0.5))


SLOW = HeadingModel((1.0, 0.9945), (2.17e-4, -7.1e-5), (1.0, 1.0))
"""Springer's, with states in rad."""


@pytest.mark.parametrize("yaw", [SLOW, SLOW._replace(poles=(1.002, 0.9945)), SLOW._replace(poles=(1.0, 0.4))])
def test_bounds_hold_the_filter_of_every_deviation_and_stay_as_wide_as_the_box(yaw):
    """Readings at 10 Hz with pauses, from any first heading; each filter knows one deviation."""
    bounds, filters = aboard(yaw, DEVIATION), [aboard(yaw, 0.0) for _ in DEVIATIONS]
    draws, heading = np.random.default_rng(3), 2.0
    for k in range(3000):
        order = 3.0 * math.sin(0.01 * k)
        heading += 2e-3 * math.sin(1e-3 * k)
        reading = heading + math.radians(1.0) * draws.standard_normal()
        is_there = k % 2 == 0 and k % 400 < 300
        low, high = bounds.step(order, [reading] if is_there else None, 0.05)
        for each, deviation in zip(filters, DEVIATIONS, strict=True):
            held = each.step(order, [reading - deviation(heading, k)] if is_there else None, 0.05)
            assert low <= held[0] <= held[1] <= high
    assert 2.0 * DEVIATION < high - low < 2.6 * DEVIATION
    assert math.degrees(bounds.heading_std) == pytest.approx(math.degrees(high - low) / math.sqrt(12.0), rel=0.2)


def test_one_reading_is_enough_for_bounds_and_none_for_all_round():
    bounds = aboard(SLOW, DEVIATION)
    assert bounds.heading_std > 3.0
    low, high = bounds.step(0.0, [-3.0], 0.025)
    assert low < -3.0 < high and high - low < 2.1 * DEVIATION
    with pytest.raises(InputError, match=r"heading\.deviation is -1"):
        DeviationBounds(SLOW, -1.0, 0.1, 0.1)


def test_coefficients_of_a_compass_without_memory_have_bounds_too():
    plain = composite_model(CompassModel(0.0, 0.0, 1.0, 1.0, 0.0), PHYSICAL_YAW)
    bounds, one = IntervalFilter(box_of(plain, 0.01)), CompositeFilter(plain)
    for k in range(60):
        low, high = bounds.step(math.sin(0.1 * k), np.full(10, 0.1))
        assert low <= one.step(math.sin(0.1 * k), np.full(10, 0.1)) <= high

"""Guidance laws: the toolbox's numbers, symmetries, and boats that converge to the path."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from steerway.core import InputError, LegState, leg_direction, track_errors
from steerway.guidance import (
    AdaptiveLineOfSight,
    IntegralLineOfSight,
    LineOfSight,
    LowPass,
    Mission,
    PurePursuit,
    ReferenceModel,
    Route,
    TrackingFilter,
    VectorField,
)
from steerway.guidance.testing import off_path, turn_path, wheel_over
from tests.golden import assert_golden, golden

P1_WAYPOINTS = ([0.0, 2000.0, 5000.0, 3000.0, 6000.0, 10000.0], [0.0, 0.0, 5000.0, 8000.0, 12000.0, 12000.0])

all_laws = pytest.mark.parametrize(
    "new_law",
    [
        lambda: LineOfSight(20.0),
        lambda: VectorField(0.1, 1.0),
        lambda: IntegralLineOfSight(20.0, 0.3, integral=5.0),
        lambda: AdaptiveLineOfSight(20.0, 2e-3, crab_angle=0.1),
        PurePursuit,
    ],
    ids=["line of sight", "vector field", "integral", "adaptive", "pursuit"],
)


def on_line(cross_track, direction=0.0, along_track=0.0):
    """The state of a boat beside a leg whose end is 1 km ahead."""
    left = 1000.0 - along_track
    bearing = math.remainder(direction - math.atan2(cross_track, left), 2.0 * math.pi)
    return LegState(1, direction, along_track, cross_track, left, math.hypot(left, cross_track), bearing, math.nan)


@pytest.mark.parametrize(
    ("law", "radius", "table", "angle", "across"),
    [
        (LineOfSight(500.0), 400.0, "los_chi", "chi_ref_D500_R400", "ye_D500_R400"),
        (LineOfSight(800.0), 50.0, "los_chi", "chi_ref_D800_R50", "ye_D800_R50"),
        (AdaptiveLineOfSight(500.0, 2e-4), 400.0, "los_psi", "alos_psi_ref", "alos_ye"),
        (IntegralLineOfSight(500.0, 0.3), 400.0, "los_psi", "ilos_psi_ref", "ilos_ye"),
    ],
)
def test_a_law_gives_the_reference_numbers(shared_data, law, radius, table, angle, across):
    rows = golden(shared_data, table)
    mission = Mission(Route(*P1_WAYPOINTS, acceptance=radius), at_end="continue")
    out = []
    for north, east in zip(rows["x"], rows["y"], strict=True):
        leg, before = mission.step(north, east, 0.5), getattr(law, "crab_angle", math.nan)
        out.append((law.step(leg, math.nan, math.nan, 0.5).angle, leg.cross_track, leg.target, before))
    angles, errors, targets, estimates = np.array(out).T
    assert_golden(angles, rows[angle])
    assert_golden(errors, rows[across])
    if isinstance(law, AdaptiveLineOfSight):
        assert_golden(estimates, rows["alos_beta_hat"])
        np.testing.assert_array_equal(targets[1:], np.minimum(rows["alos_k"], 5)[:-1])  # that of the next call


def test_cross_track_gives_the_reference_numbers(shared_data):
    for row in golden(shared_data, "crosstrack"):
        direction = leg_direction(row["x_ref"], row["y_ref"], row["x_t"], row["y_t"])
        _, cross_track = track_errors(row["x"], row["y"], row["x_ref"], row["y_ref"], direction)
        assert_golden([cross_track] * 2, [row["y_e"], row["y_e_wpt"]])


@pytest.mark.parametrize(
    ("make", "output"),
    [
        (lambda: LineOfSight(0.0), "line_of_sight.lookahead is 0"),
        (lambda: IntegralLineOfSight(-5.0, 1.0), "integral_line_of_sight.lookahead is -5"),
        (lambda: IntegralLineOfSight(5.0, -1.0), "integral_line_of_sight.integral_gain is -1"),
        (lambda: AdaptiveLineOfSight(5.0, math.inf), "adaptive_line_of_sight.gain is inf"),
        (lambda: VectorField(0.0), "vector_field.steepness is 0"),
        (lambda: VectorField(0.1, 2.0), "vector_field.approach is 2, expected an angle"),
        (lambda: LowPass(0.0), "low_pass.time_constant is 0"),
        (lambda: TrackingFilter(-1.0), "tracking_filter.bandwidth is -1"),
        (lambda: ReferenceModel(math.inf), "reference_model.bandwidth is inf"),
        (lambda: ReferenceModel(1.0, max_rate=math.nan), "reference_model.max_rate is nan"),
    ],
)
def test_a_law_or_a_reference_filter_that_cannot_be_is_refused(make, output):
    with pytest.raises(InputError, match=output):
        make()


def test_a_field_of_a_right_angle_is_line_of_sight():
    for cross_track in (-40.0, 3.0):
        leg = on_line(cross_track, 0.7)
        assert VectorField(1 / 25.0).step(leg, 0.2, 2.0, 1.0) == pytest.approx(LineOfSight(25.0).step(leg, 0.2, 2.0, 1))


@all_laws
@given(cross_track=st.floats(-200.0, 200.0), course=st.floats(-math.pi, math.pi), direction=st.floats(-3.1, 3.1))
def test_the_rate_is_the_derivative_of_the_angle(new_law, cross_track, course, direction):
    """For a boat on `course` at 2 m/s the desired angle changes at the rate that the law returns."""
    h, speed = 1e-4, 2.0

    def beside(along, cross):
        left = 1000.0 - along
        bearing = direction - math.atan2(cross, left)
        return LegState(1, direction, along, cross, left, math.hypot(left, cross), bearing, math.nan)

    law = new_law()
    first = law.step(beside(0.0, cross_track), course, speed, h)
    along = speed * math.cos(course - direction) * h
    second = law.step(beside(along, cross_track + speed * math.sin(course - direction) * h), course, speed, h)
    change = math.remainder(second.angle - first.angle, 2 * math.pi) / h
    assert first.rate == pytest.approx(change, abs=2e-5)


@all_laws
def test_what_is_unknown_leads_to_no_rate_and_no_learning(new_law):
    law, leg = new_law(), on_line(12.0)
    assert new_law().step(leg, math.nan, 1.0, 1.0).rate == pytest.approx(new_law().step(leg, 0.0, 0.0, 1.0).rate)
    before = dict(getattr(law, "__dict__", {}))
    nothing = law.step(LegState(1, 0.0, *[math.nan] * 6), 0.0, 1.0, 1.0)
    assert math.isnan(nothing.angle)  # a number would pass for a course
    assert dict(getattr(law, "__dict__", {})) == before


@all_laws
@given(cross_track=st.floats(-300, 300), course=st.floats(-3, 3), direction=st.floats(-math.pi, math.pi))
def test_mirrored_and_turned(new_law, cross_track, course, direction):
    if not isinstance(new_law(), (LineOfSight, VectorField, PurePursuit)):
        one, other = new_law(), new_law()
        for name in ("integral", "crab_angle"):
            if hasattr(other, name):
                setattr(other, name, -getattr(other, name))
    else:
        one = other = new_law()
    angle, rate, _ = one.step(on_line(cross_track), course, 1.5, 1.0)
    mirrored = other.step(on_line(-cross_track), -course, 1.5, 1.0)
    assert mirrored.angle == pytest.approx(-angle, abs=1e-12) and mirrored.rate == pytest.approx(-rate, abs=1e-12)
    turned = new_law().step(on_line(cross_track, direction), course + direction, 1.5, 1.0)
    assert math.remainder(turned.angle - direction - angle, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)
    assert turned.rate == pytest.approx(rate, abs=1e-9) and -math.pi <= turned.angle < math.pi


@pytest.mark.parametrize("law", [LineOfSight(20.0), VectorField(0.05), VectorField(0.1, 1.0)])
def test_a_perfect_course_runs_into_the_path_without_crossing(law):
    """P1 (37)–(38): the Lyapunov function decreases all the way, from any side and any distance."""
    for cross_track in (-400.0, 60.0):
        distance = [cross_track]
        for _ in range(60000):
            course, _, _ = law.step(on_line(distance[-1]), math.nan, math.nan, 0.02)
            distance.append(distance[-1] + 0.02 * 1.5 * math.sin(course))
        assert np.all(np.diff(np.abs(distance)) <= 0.0) and abs(distance[-1]) < 1e-3


def drifting(law, seconds=1500.0, dt=0.1, speed=1.2, drift=0.3):
    """Cross-track error at the end of a long leg north, steered by heading in a current to the east."""
    cross_track = 5.0
    for _ in range(int(seconds / dt)):
        heading = law.step(on_line(cross_track), math.nan, math.nan, dt).angle
        cross_track += dt * (speed * math.sin(heading) + drift)
    return cross_track


def test_a_steady_current_sets_proportional_heading_off_and_the_others_not():
    lookahead = 15.0
    offset = lookahead * math.tan(math.asin(0.3 / 1.2))
    assert drifting(LineOfSight(lookahead)) == pytest.approx(offset, rel=1e-6)
    integral, adaptive = IntegralLineOfSight(lookahead, 0.3), AdaptiveLineOfSight(lookahead, 2e-3)
    assert abs(drifting(integral)) < 1e-3 and abs(drifting(adaptive)) < 1e-3
    assert adaptive.crab_angle == pytest.approx(math.asin(0.3 / 1.2), abs=1e-4)
    assert math.atan(0.3 * integral.integral / lookahead) == pytest.approx(math.asin(0.3 / 1.2), abs=1e-4)
    law = AdaptiveLineOfSight(20.0, 1e-2)
    for _ in range(10000):
        law.step(on_line(500.0), math.nan, math.nan, 0.1)
    assert law.crab_angle == law.largest_crab, "a long approach does not wind it up"
    for _ in range(10000):
        law.step(on_line(-500.0), math.nan, math.nan, 0.1)
    assert law.crab_angle == -law.largest_crab


@pytest.mark.parametrize("current", [(0.0, 0.0), (0.5, -0.4), (0.1, 0.4)])
@pytest.mark.parametrize("direction", [0.3, 2.0])
def test_an_early_turn_ends_on_the_next_leg(direction, current):
    following = direction + 1.5
    path, time = turn_path(direction, 1.5, 1.2, *current, 1.0, 0.2, 0.2)
    lead = wheel_over(direction, following, *path[-1])
    begin = np.array([-lead * math.cos(direction), -lead * math.sin(direction)])
    _, across = track_errors(*(begin + path[-1]), 0.0, 0.0, following)
    assert lead > 0.0 and abs(across) < 1e-9
    assert len(path) * 0.02 == pytest.approx(time, abs=0.03)
    assert not path[0].any() and math.dist(path[0], path[1]) < 0.02 * 2.0
    middle, (ahead_n, ahead_e) = path[len(path) // 2], (path[1] - path[0]) / math.dist(path[0], path[1])
    abeam = np.array([-ahead_e, ahead_n])
    assert off_path(path, *middle) == (pytest.approx(0.0, abs=1e-9), False)
    assert off_path(path, *(path[0] + 0.1 * abeam))[0] > 0.0 > off_path(path, *(path[0] - 0.1 * abeam))[0]
    assert off_path(path, *(path[-1] + 2.0 * (path[-1] - path[-2])))[1]


def test_the_distance_from_a_path_is_that_of_its_nearest_piece_and_a_turn_is_as_fast_as_allowed():
    path = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]])
    assert off_path(path, 5.0, 1.0) == (1.0, False)
    assert off_path(path, 9.0, 5.0) == (1.0, False)
    assert off_path(path, 12.0, 8.0) == (-2.0, False)
    assert off_path(path, 12.0, 11.0) == (-2.0, True)
    to, current = 1.5, (0.3, 0.1)
    path, _ = turn_path(0.0, to, 1.2, *current, 1.0, 0.2, 0.2, after=2.0, speed_time=0.2, along_most=0.8)
    north, east = (path[-1] - path[-2]) / 0.02
    assert north * math.cos(to) + east * math.sin(to) == pytest.approx(0.8, abs=0.01)

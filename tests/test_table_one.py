"""The five-state filter (Table 1 of P0) compared with dense matrices and with the general filter."""

import itertools
import math

import numpy as np
import pytest

from steerway import Profile
from steerway.core import wrap
from steerway.estimation.testing import (
    FUSED,
    LONGEST_GAP,
    Asked,
    Fix,
    Rows,
    correct,
    five_state,
    innovation,
    model_empty_bank,
    model_of_profile,
    normalised_square,
    place_by_fix,
    room_to_keep,
    run_record,
)
from tests.five_state_by_matrices import PROFILE, dense, responses, winding
from tests.reference_outputs import sorties

STEPS = (0.02, 0.2, 1.0)
NORTH, EAST, SPEED, COURSE, RATE = range(5)
NO_AIDS, NONE = np.empty((0, 5)), np.empty(0)
GENERAL = {"run": run_record, "fast": five_state.run}


def model_without_drift(profile, outlier_rate=1e-15):
    """Model without drift at low speed and, by default, without outliers: Table 1 contains neither."""
    model = model_of_profile(profile)
    model.modes["drift_speed"], model.receiver["outlier_rate"] = 1e-6, outlier_rate
    return model


def some_state(seed):
    """State of a moving vessel, and a full covariance in terms of the course (not the velocity across it)."""
    rng = np.random.default_rng(seed)
    x = np.array([3.0, -2.0, rng.uniform(0.5, 8.0), rng.uniform(-3.1, 3.1), rng.uniform(-0.3, 0.3)])
    root = rng.standard_normal((5, 5)) * rng.uniform(0.03, 0.3, 5)[:, None]
    return x, root @ root.T


def across(x, p):
    """Covariance in terms of the velocity across, from that in terms of the course; with 1/U as speed the inverse."""
    scale = np.ones(len(p))
    scale[COURSE] = x[SPEED]
    return p * np.outer(scale, scale)


def of_course(x, p):
    return across([0.0, 0.0, 1.0 / x[SPEED]], np.triu(p) + np.triu(p, 1).T)


def started(model, x, p):
    bank = model_empty_bank(model)
    bank.x[0], bank.p[0] = x, across(x, p)
    bank.probability[0], bank.run["started"] = 1.0, 1
    return bank


def record(time, north, east):
    return Rows(np.asarray(time, float), north, east, NONE, NO_AIDS, np.empty(0, np.int64))


def run(rows, model, bank, by="fast"):
    """Output (n, FUSED + 2) of the fast or the general filter for a record."""
    out = np.empty((len(rows.time), FUSED + 2))
    GENERAL[by](rows, model, bank, Asked(out, NONE, room_to_keep(0, model), 0))
    return out


@pytest.mark.parametrize("decays", [(0.0, 0.3), (0.01, 0.0), (0.2, 2.0)])
def test_a_prediction_is_dense_f_p_f_plus_q(decays):
    profile = PROFILE.model_copy(update={"speed_decay": decays[0], "course_rate_decay": decays[1]})
    model, nothing = model_without_drift(profile), np.full(2, np.nan)
    for seed, dt in itertools.product(range(5), STEPS):
        x, p = some_state(seed)
        moved, f, q = dense(profile, dt).step(x)
        bank = started(model, x, p)
        run(record([0.0, dt], nothing, nothing), model, bank)
        moved[COURSE] = wrap(moved[COURSE])
        np.testing.assert_allclose(bank.x[0], moved, rtol=1e-12, atol=1e-12)
        expected = f @ p @ f.T + q
        np.testing.assert_allclose(of_course(moved, bank.p[0]), expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


ERRORS = {"error_std": 0.4, "error_time": 8.0, "drift_std": 0.8, "drift_time": 60.0}
"""Two first-order errors of the receiver, north and east: nine states; a fix measures position plus both errors."""


@pytest.mark.parametrize("parameters", [{}, {"speed_decay": 0.02}, ERRORS])
def test_the_filter_is_the_dense_filter(parameters):
    """Three hundred fixes of a vessel under way, by kernels and by matrices."""
    profile = PROFILE.model_copy(update=parameters)
    time, north, east = winding(300)
    model, by_matrices = model_without_drift(profile), dense(profile, 0.2)
    variance, left = np.empty(0), np.empty(0)
    if parameters is ERRORS:
        variance, left = np.repeat([0.4**2, 0.8**2], 2), np.exp(-0.2 / np.repeat([8.0, 60.0], 2))
    x = np.r_[north[0], east[0], 2.5, 0.0, 0.0, np.zeros(len(variance))]
    p = np.diag(np.r_[0.5, 0.5, 0.01, 0.01, 0.001, variance])
    bank = started(model, x, p)
    run(record(time[1:] - 0.2, north[1:], east[1:]), model, bank, "run" if parameters is ERRORS else "fast")
    h = np.hstack([np.eye(2), np.zeros((2, 3)), *[np.eye(2)] * (len(variance) // 2)])
    for k in range(1, 300):
        if k > 1:
            f, q = np.diag(np.r_[np.ones(5), left]), np.diag(np.r_[np.zeros(5), variance * (1.0 - left**2)])
            x[:5], f[:5, :5], q[:5, :5] = by_matrices.step(x[:5])
            x[5:] *= left
            p = f @ p @ f.T + q
        gain = p @ h.T @ np.linalg.inv(h @ p @ h.T + profile.position_std**2 * np.eye(2))
        x, p = x + gain @ ([north[k], east[k]] - h @ x), p - gain @ h @ p
    x[COURSE] = wrap(x[COURSE])
    np.testing.assert_allclose(bank.x[0], x, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(of_course(x, bank.p[0]), p, rtol=1e-9, atol=1e-9)


TROUBLE = (sorties.weaving_fixes, sorties.outliers, sorties.burst, sorties.standstill, sorties.fast_start, sorties.gaps)


@pytest.mark.parametrize("sortie", TROUBLE)
@pytest.mark.parametrize("kind", ["white", "no-rate-decay", "speed-decay"])
def test_it_is_the_general_filter_with_one_mode(kind, sortie):
    """Rows, state and covariance agree through outliers, gaps, rest and starts, also where the fast path is left."""
    model, fixes = model_of_profile(Profile(**sorties.KINDS[kind])), sortie()
    north = sorties.EARTH_RADIUS * (fixes.latitude - fixes.latitude[0])
    east = sorties.EARTH_RADIUS * math.cos(fixes.latitude[0]) * (fixes.longitude - fixes.longitude[0])
    rows = record(fixes.time - fixes.time[0], north, east)
    rows = rows._replace(restarts=np.flatnonzero(np.diff(rows.time) > LONGEST_GAP) + 1)
    fast, general = model_empty_bank(model), model_empty_bank(model)
    limit = {"rtol": 1e-12, "atol": 1e-12}
    np.testing.assert_allclose(run(rows, model, fast), run(rows, model, general, "run"), **limit)
    np.testing.assert_allclose(fast.x, general.x, **limit)
    np.testing.assert_allclose(fast.p, general.p, **limit)


def test_responses_to_a_unit_are_those_in_closed_form():
    for rate, t in itertools.product((0.0, 1e-6, 1e-3, 0.0999, 0.1001, 0.3, 3.0), (0.02, 1.0, 3.0)):
        found, expected = five_state.decaying(rate, t), responses(rate, t) if rate else (1.0, t, 0.5 * t * t)
        np.testing.assert_allclose(found, expected, rtol=1e-9)


def upper(p):
    """P as the filter keeps it: what lies below the diagonal is no part of it."""
    kept = np.triu(p)
    kept[np.tril_indices(len(p), -1)] = 1e3
    return kept


@pytest.mark.parametrize("pairs", [0, 1])
def test_a_fix_with_error_states(pairs):
    """Corrects; and a position that was set to it is the fix less the error states."""
    n, g = 5 + 2 * pairs + 1, 5 * pairs  # the last is a state that no fix measures
    rng = np.random.default_rng(0)
    x, root = rng.normal(size=n), rng.normal(size=(n, n)) * rng.uniform(0.2, 1.0, n)[:, None]
    p = root @ root.T + 0.1 * np.eye(n)
    c, noise, fix = np.eye(2, n), np.diag([0.3, 0.7]), Fix(2.0, -1.0, 0.3, 0.7)
    if pairs:
        c[:, 5:7] = np.eye(2)
    s, nu = c @ p @ c.T + noise, fix[:2] - c @ x
    kept, x_after = upper(p), x.copy()
    parts = innovation(x, kept, fix, g)
    np.testing.assert_allclose(parts, [*nu, s[0, 0], s[0, 1], s[1, 1]], rtol=1e-10)
    assert normalised_square(parts) == pytest.approx(nu @ np.linalg.inv(s) @ nu, rel=1e-9)
    correct(x_after, kept, np.empty((2, n)), fix, g)
    gain = p @ c.T @ np.linalg.inv(s)
    np.testing.assert_allclose(x_after, x + gain @ nu, rtol=1e-9)
    rest = np.eye(n) - gain @ c
    np.testing.assert_allclose(np.triu(kept), np.triu(rest @ p @ rest.T + gain @ noise @ gain.T), rtol=1e-9, atol=1e-9)
    move, kept = np.eye(n) - np.eye(n, 2) @ c, upper(p)
    place_by_fix(kept, fix, g)
    set_to_fix = move @ p @ move.T + np.diag([0.3, 0.7, *np.zeros(n - 2)])
    np.testing.assert_allclose(np.triu(kept), np.triu(set_to_fix), rtol=1e-9, atol=1e-9)

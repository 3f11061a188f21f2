"""The update by a fix with errors of the receiver as states, against matrices written out."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from steerway.estimation.testing import Fix, correct, innovation, normalised_square, place_by_fix

PAIRS = (0, 1)


def state(seed: int, n: int):
    """(x, P) with P whole, and every correlation."""
    rng = np.random.default_rng(seed)
    x = rng.normal(size=n)
    x[2:5] = rng.uniform(1.0, 4.0), rng.uniform(-3.0, 3.0), rng.uniform(-0.2, 0.2)
    root = rng.normal(size=(n, n)) * rng.uniform(0.2, 1.0, n)[:, None]
    return x, root @ root.T + 0.1 * np.eye(n)


def upper(p):
    """P as the filter keeps it: what lies below the diagonal is no part of it."""
    kept = np.triu(p)
    kept[np.tril_indices(len(p), -1)] = 1e3
    return kept


def assert_covariance(kept, expected):
    assert_allclose(np.triu(kept), np.triu(expected), rtol=1e-9, atol=1e-9)


def measures(n, pairs):
    c = np.zeros((2, n))
    c[0, 0] = c[1, 1] = 1.0
    for k in range(pairs):
        c[0, 5 + 2 * k] = c[1, 6 + 2 * k] = 1.0
    return c


@pytest.mark.parametrize("pairs", PAIRS)
def test_a_fix_with_error_states(pairs):
    n = 5 + 2 * pairs + 1  # and a state that no fix measures
    x, p = state(0, n)
    c, noise, fix = measures(n, pairs), np.diag([0.3, 0.7]), Fix(2.0, -1.0, 0.3, 0.7)
    s, nu = c @ p @ c.T + noise, fix[:2] - c @ x
    g = 5 if pairs else 0
    kept, x_after = upper(p), x.copy()
    parts = innovation(x, kept, fix, g)
    assert_allclose(parts, [*nu, s[0, 0], s[0, 1], s[1, 1]], rtol=1e-10)
    assert normalised_square(parts) == pytest.approx(nu @ np.linalg.inv(s) @ nu, rel=1e-9)
    correct(x_after, kept, np.empty((2, n)), fix, g)
    gain = p @ c.T @ np.linalg.inv(s)
    assert_allclose(x_after, x + gain @ nu, rtol=1e-9)
    rest = np.eye(n) - gain @ c
    assert_covariance(kept, rest @ p @ rest.T + gain @ noise @ gain.T)


@pytest.mark.parametrize("pairs", PAIRS)
def test_a_position_set_to_a_fix_is_the_fix_less_the_error_states(pairs):
    n = 5 + 2 * pairs + 1
    _, p = state(3, n)
    move = np.eye(n)
    move[:2, :2] = 0.0
    for k in range(pairs):
        move[0, 5 + 2 * k] = move[1, 6 + 2 * k] = -1.0
    expected = move @ p @ move.T + np.diag([0.3, 0.7, *np.zeros(n - 2)])
    kept = upper(p)
    place_by_fix(kept, Fix(0.0, 0.0, 0.3, 0.7), 5 if pairs else 0)
    assert_covariance(kept, expected)

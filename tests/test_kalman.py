"""The update by a fix with errors of the receiver as states, against matrices written out."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from steerway.estimation.testing import Fix, correct, innovation, normalised_square, place_by_fix


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
    assert_allclose(parts, [*nu, s[0, 0], s[0, 1], s[1, 1]], rtol=1e-10)
    assert normalised_square(parts) == pytest.approx(nu @ np.linalg.inv(s) @ nu, rel=1e-9)
    correct(x_after, kept, np.empty((2, n)), fix, g)
    gain = p @ c.T @ np.linalg.inv(s)
    assert_allclose(x_after, x + gain @ nu, rtol=1e-9)
    rest = np.eye(n) - gain @ c
    assert_allclose(np.triu(kept), np.triu(rest @ p @ rest.T + gain @ noise @ gain.T), rtol=1e-9, atol=1e-9)
    move, kept = np.eye(n) - np.eye(n, 2) @ c, upper(p)
    place_by_fix(kept, fix, g)
    set_to_fix = move @ p @ move.T + np.diag([0.3, 0.7, *np.zeros(n - 2)])
    assert_allclose(np.triu(kept), np.triu(set_to_fix), rtol=1e-9, atol=1e-9)

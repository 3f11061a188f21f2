"""Golden numbers: tables whose columns are read by name, and the forces of a public run; limits that are missed."""

import math

import numpy as np
import pytest

RTOL, ATOL = 1e-9, 1e-10


def golden(shared_data, name) -> np.ndarray:
    """The rows of a reference table as a structured array."""
    return np.genfromtxt(shared_data / "reference" / "mss" / f"{name}.csv", delimiter=",", names=True)


def columns(table, *names) -> np.ndarray:
    """The named columns (n, len(names))."""
    return np.stack([table[name] for name in names], axis=-1)


def assert_golden(measured, expected):
    np.testing.assert_allclose(measured, expected, rtol=RTOL, atol=ATOL)


def missed(reason):
    """Mark a test of a limit that is missed: the assertion fails until the limit is met."""
    return pytest.mark.xfail(strict=True, raises=AssertionError, reason=reason)


def no_worse(is_as_good, found):
    """Where a limit is missed by more than was measured, the test fails, and not as expected."""
    if not is_as_good:
        pytest.fail(f"worse than it was: {found}")


def cybership_forces(time):
    """The forces of CyberShip II's public run, held over each of its steps."""
    return 0.5 + 1.2 * math.sin(0.1 * time), 0.8 * math.cos(0.07 * time), 0.15 * math.sin(0.05 * time)

"""A log and what is inferred from it, once a process: whoever needs a fitted profile takes this one."""

from functools import cache

from steerway.estimation.testing import LogEstimator
from tests.scenes import turning

STD = 0.4


@cache
def small_craft():
    """A boat of 1.5 m/s that wanders, 5 Hz: the scene, its fixes (STD m of noise), and the estimator of the log."""
    scene = turning(1.5, 0.7, 200.0, seed=1)
    fixes = scene.fixes(STD, 1)
    return scene, fixes, LogEstimator(fixes)

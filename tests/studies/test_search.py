"""What the search for structures finds does not hang on luck: fixes moved by micrometres lead to the same evidence."""

import numpy as np
import pytest

import steerway
from steerway.estimation.testing import Track, infer
from tests.golden import missed, no_worse
from tests.scenes import turning

MOVED, SEARCHES = 1e-6, 4
"""m, far below any digit; searches of each log."""
SHORT = missed("after four rounds 5 to 22 apart: more rounds meet, and cost a quarter")
LOGS = (
    ("furuno_scx20_n2k/furuno-130842-figure8-fast.raw", "src 52"),
    ("furuno_scx20_n2k/furuno-130842-wide-turn.raw", "src 52"),
    pytest.param("rob_atlantic_1hz/nukuhiva_multitalker.nmea", None, marks=SHORT),
    pytest.param("signalk_samples/plaka.log", None, marks=SHORT),
    pytest.param("rob_atlantic_1hz/gx_to_gavres.nmea", None, marks=SHORT),
    pytest.param("rob_atlantic_1hz/tomales_kayak.nmea", None, marks=SHORT),
    pytest.param("anemomind_corrupt/psaros33_20140627_gaps_dups.nmea", None, marks=SHORT),
)
APART = 5.0
"""Log evidence by which the best of several searches may differ: more is called strong (`selection.BETTER` is 3)."""
FURTHEST = 23.0
"""The most that was measured where it is missed (tomales)."""


def searches(fixes):
    """(parts, log evidence) of the best structure of every search."""
    record = Track(fixes, ()).record
    found = []
    for seed in range(SEARCHES):
        moved = (MOVED if seed else 0.0) * np.random.default_rng(seed).standard_normal((2, len(record.time)))
        fits = infer(record._replace(north=record.north + moved[0], east=record.east + moved[1])).fits
        best = max(fits, key=lambda fit: fit.evidence)
        found.append((best.parts, best.evidence))
    return found


def assert_alike(found):
    evidence = [each for _, each in found]
    apart = max(evidence) - min(evidence)
    no_worse(apart <= FURTHEST, found)
    assert apart < APART, found


@pytest.mark.parametrize(("log", "source"), LOGS)
def test_a_search_of_a_recorded_log_finds_the_same_again(log, source, shared_data):
    fixes = steerway.read(shared_data / "data" / log, source=source)
    assert_alike(searches(fixes.rows(fixes.has_position)))


@pytest.mark.parametrize("noise", [0.02, 0.5])
def test_a_search_of_a_scene_finds_the_same_again(noise):
    assert_alike(searches(turning(1.5, 0.3, 600.0, seed=9).fixes(noise, 9)))

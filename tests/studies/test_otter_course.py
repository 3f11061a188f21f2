"""The study of P0 sections 5–7: what noise does to the published tuning, unwinding, and a real log."""

import math

import numpy as np
import pytest

from steerway_studies.testing import LOGS, OTTER_PRINTED_GAINS, as_printed, as_published, otter_course, turned
from steerway_studies.testing import logs as otter_logs


def test_a_centimetre_of_noise_undoes_the_published_tuning():
    quiet, noisy = as_published(), as_published(0.01)
    assert abs(quiet.cog[-1]) < math.radians(0.5)
    assert np.abs(noisy.cog - noisy.desired)[noisy.time > 5.0].max() > math.radians(45.0)


def test_the_published_tuning_is_for_fixes_without_noise():
    """P0 says "not sensitive": true without noise; with 1 cm the least error is elsewhere, and the paper is lost."""
    record = as_published()
    quiet = [otter_course.retuned(record, 0.0, ratio, 2) for ratio in (1e9, 5e13)]
    noisy = [otter_course.retuned(record, 0.01, ratio, 2) for ratio in (1e2, 1e5, 5e13)]
    assert quiet[0] == pytest.approx(quiet[1], rel=0.2) and max(quiet) < 0.05
    assert noisy[0] < 1.0 and noisy[1] > 2.0 * noisy[0] and noisy[2] > 45.0


def test_unwinding():
    start, command = math.radians(350.0), math.radians(10.0)
    assert turned(OTTER_PRINTED_GAINS, start, command, wrapped=True) == pytest.approx(math.radians(20.0), abs=1e-2)
    assert turned(OTTER_PRINTED_GAINS, start, command, wrapped=False) == pytest.approx(math.radians(-340.0), abs=1e-2)


def test_a_real_log_beside_its_receiver(shared_data):
    """Once settled both filters say what the receiver says 2.5 s later; the printed one may have found U < 0."""
    log = LOGS[0]
    fixes = otter_logs._opened(shared_data / "data" / log.path, log)
    printed = as_printed(fixes, log.process_noise)
    settled = printed.time > printed.time[0] + 30.0
    output = np.interp(printed.time + 2.5, fixes.time[np.isfinite(fixes.cog)], _unwrapped(fixes.cog))
    error = np.mod(printed.cog - output + np.pi, 2.0 * np.pi) - np.pi
    assert math.degrees(np.sqrt(np.mean(error[settled][:-20] ** 2))) < 2.0
    study = otter_course.Results("x")
    otter_logs._add(study, log, fixes)
    assert study.numbers["log_motor_boat_product_cog_rms_deg"] < 1.0
    assert study.numbers["log_motor_boat_product_sog_rms_mps"] < 0.1


def _unwrapped(course):
    return np.unwrap(course[np.isfinite(course)])

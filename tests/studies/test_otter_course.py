"""The study of P0 sections 5–7: its known numbers, what noise does, the real logs, and what it writes."""

import math

import numpy as np
import pytest

from steerway.identification import identify_yaw_from_fixes
from steerway_studies.testing import (
    COMMAND,
    LOGS,
    OTTER_PRINTED_GAINS,
    as_printed,
    as_published,
    comparisons,
    named,
    otter_course,
    turned,
    zigzag,
)
from steerway_studies.testing import logs as otter_logs


@pytest.fixture(scope="module")
def results():
    patch = pytest.MonkeyPatch()
    patch.setattr(otter_course, "over_cases", lambda run, seeds, progress=None: [run(seed) for seed in seeds])
    patch.setattr(otter_logs, "LOGS", LOGS[:1])
    yield named("otter-course").run(1, 1, None)
    patch.undo()


def test_both_readings_of_the_gains(results):
    numbers = results.numbers
    assert numbers["gain_k_p"] == pytest.approx(92.98, abs=0.01)
    assert numbers["gain_k_p_from_ratio"] == pytest.approx(93.15, abs=0.01)
    assert numbers["gain_t_d_s"] == pytest.approx(0.889, abs=1e-3)
    assert numbers["gain_t_i_s"] == pytest.approx(6.67, abs=0.01)
    poles = [numbers[f"pole_{k}_radps"] for k in (1, 2, 3)]
    np.testing.assert_allclose(np.divide(poles, 1.5), [-0.133, -0.587, -1.280], atol=1e-3)


def test_a_centimetre_of_noise_undoes_the_published_tuning():
    quiet, noisy = as_published(), as_published(0.01)
    assert abs(quiet.cog[-1]) < math.radians(0.5)
    assert np.abs(noisy.cog - noisy.desired)[noisy.time > 5.0].max() > math.radians(45.0)


def test_the_boat_turns_towards_the_commanded_course():
    record = as_published(duration=15.0)
    assert record.cog[-1] == pytest.approx(COMMAND, abs=math.radians(1.0))
    assert record.east[-1] > 2.0
    assert np.all(record.commanded[50:100, 0] > record.commanded[50:100, 1])


def test_the_product_steers_through_noise():
    numbers = [comparisons.noisy_numbers(seed) for seed in (1, 2)]
    for label, target in (("0p1", 1.4), ("0p5", 2.1)):
        assert np.mean([each[f"noisy_{label}_course_rms_deg"] for each in numbers]) <= target
        assert np.mean([each[f"noisy_{label}_paper_feedforward_rms_deg"] for each in numbers]) > target
    assert np.mean([each["noisy_0p5_at_1p5_rms_deg"] for each in numbers]) > 10.0
    assert all(math.isfinite(value) for each in numbers for value in each.values())


def test_the_course_answers_more_slowly_than_the_papers_nomoto():
    time, moment, fixes = zigzag(0.1, 1)
    model = identify_yaw_from_fixes(fixes, time[::5], moment[::5])
    assert 2.5 < model.time_constant.value < 3.5 and 0.008 < model.gain.value < 0.012
    assert 0.0 == pytest.approx(model.rudder_bias.value, abs=0.1)


def test_unwinding():
    start, command = math.radians(350.0), math.radians(10.0)
    assert turned(OTTER_PRINTED_GAINS, start, command, wrapped=True) == pytest.approx(math.radians(20.0), abs=1e-2)
    assert turned(OTTER_PRINTED_GAINS, start, command, wrapped=False) == pytest.approx(math.radians(-340.0), abs=1e-2)


def test_without_logs_the_study_says_so(monkeypatch):
    monkeypatch.delenv("STEERWAY_DATA", raising=False)
    study = otter_course.Results("x")
    otter_logs.add_logs(study)
    assert "STEERWAY_DATA" in study.remarks[0] and not study.numbers


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

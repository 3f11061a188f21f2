"""The studies on recorded logs and on low speed, and the choice of a profile that they stand on."""

import json
import math

import numpy as np
import pytest

import steerway
import steerway_studies as studies
from steerway.estimation import choose_profile
from steerway_studies import low_speed
from tests.scenes import angle_error, straight, turning


@pytest.fixture(scope="module")
def field(shared_data):
    """The numbers of the study real-logs."""
    return studies.named("real-logs").run(None, 0, None)


def missed(reason):
    return pytest.mark.xfail(strict=True, reason=reason)


@pytest.mark.parametrize(
    ("key", "most"),
    [
        pytest.param("figure8_rate_rms_dps", 0.545, marks=missed("0.566 °/s: a slow error takes part of the turns")),
        ("figure8_rate_rms_smoothed_dps", 0.36),
        pytest.param("figure8_rate_rms_aligned_dps", 0.335, marks=missed("0.381 °/s: as above")),
        ("figure8_rate_rms_smoothed_aligned_dps", 0.21),
        ("s330_sog_rms_mps", 0.035),
        ("s330_cog_rms_deg", 0.45),
        ("seap_sog_rms_mps", 0.05),
        ("seap_cog_rms_deg", 0.5),
        pytest.param("standstill_gps_sog_median_mps", 0.15, marks=missed("0.151 m/s: a slow error taken for motion")),
        ("standstill_ac42_sog_median_mps", 0.15),
    ],
)
def test_independent_truth_on_recorded_logs(field, key, most):
    assert field.numbers[key] <= most


def test_the_lag_of_the_figure_of_eight_is_found(field):
    assert 2.4 < field.numbers["figure8_receiver_lag_s"] < 3.2  # the error is flat from 2.5 to 3.2 s


@missed("85 % of rows: a slow error taken for motion")
def test_at_a_standstill_there_is_no_course(field):
    assert field.numbers["standstill_undefined_pct"] >= 95.0


def test_no_log_is_mirrored_and_every_innovation_is_as_expected(field):
    assert sum(key.endswith("mirrored_pct") for key in field.numbers) >= 15
    for key, value in field.numbers.items():
        if key.endswith("mirrored_pct"):
            assert value == 0.0, key
        if key.endswith("nis_median"):
            assert 0.2 < value < 3.0, key
        if key.endswith("_rejected_pct"):
            assert value < 6.0 or key.startswith("pyais"), key


NARROW = pytest.mark.xfail(reason="1.1002 times the tuned rate, 1.1 asked: either side of it by rounding", strict=False)


@pytest.mark.parametrize(
    ("default", "tuned"),
    [
        pytest.param("figure8_rate_rms_dps", "figure8_rate_rms_tuned_dps", marks=NARROW),
        ("figure8_rate_rms_smoothed_dps", "figure8_rate_rms_tuned_smoothed_dps"),
        *(
            (f"{receiver}_{what}", f"{receiver}_tuned_{what}")
            for receiver in ("s330", "seap", "gp02", "pcod")
            for what in ("sog_rms_mps", "cog_rms_deg")
        ),
    ],
)
def test_the_default_is_as_good_as_tuning(field, default, tuned):
    assert field.numbers[default] < 1.1 * field.numbers[tuned]


def test_results_are_written(field, tmp_path):
    field.write(tmp_path)
    written = json.loads((tmp_path / "results.json").read_text())
    assert {"figure8_rate_rms_dps", "s330_sog_rms_mps", "standstill_undefined_pct"} <= written.keys()
    assert (tmp_path / "turns.png").exists() and (tmp_path / "ship.png").exists()


def test_course_ends_where_the_study_says(monkeypatch):
    """At rest there is no course; at 0.7 m/s there is one, and it errs by some degrees; the error falls with speed."""
    monkeypatch.setattr(low_speed, "SPEEDS", (0.0, 0.7, 3.0))
    table = low_speed.one(1, "low_cost")
    assert table.shape == (3, 2, 4)
    assert table[0, 0, 2] < 0.05
    assert table[1, 0, 2] > 0.9 and table[2, 0, 2] == 1.0
    slow, fast = np.degrees(np.sqrt(table[1:, 0, 0]))
    assert fast < 4.0 and fast < slow < 20.0


def test_studies_say_when_there_are_no_logs(monkeypatch):
    monkeypatch.delenv("STEERWAY_DATA", raising=False)
    for name in ("real-logs", "ais-prediction"):
        with pytest.raises(steerway.InputError, match="STEERWAY_DATA is ''"):
            studies.named(name).run(None, 0, None)


def expected(profile, *names):
    """Root of the sum of squares of these numbers, weighted mean over structures; 0 where a structure has none."""
    return sum(each.weight * math.hypot(*(each.values.get(n, 0.0) for n in names)) for each in profile.structures)


@pytest.mark.parametrize(("std", "rate"), [(0.02, 5.0), (0.5, 5.0), (0.5, 1.0), (3.0, 1.0)])
def test_the_receiver_is_found(std, rate):
    scene = turning(4.0, 1.0, 600.0, rate=rate, density=1e-3, decay=0.2)
    found = choose_profile(scene.fixes(std, 3))
    total = expected(found, "fix_std", "error_std")
    assert 0.6 * std < total < 1.7 * std


def test_the_choice_comes_near_the_truth_about_the_boat():
    """Estimated by the profile found, COG errs little more than by the very numbers that made the sortie."""
    made = steerway.Profile(speed_noise=1e-5, course_rate_noise=2e-3, course_rate_decay=0.3, position_std=0.5)
    errors = []
    for seed in range(8):
        scene = turning(1.3, 0.4 * seed, 300.0, seed=seed)
        fixes = scene.fixes(0.5, seed)
        errors.append(
            [np.nanmean(angle_error(steerway.estimate(fixes, p).cog, scene.cog)[100:] ** 2) for p in (None, made)]
        )
    found, known = np.sqrt(np.mean(errors, axis=0))
    assert found < 1.15 * known


def test_stretches_from_all_over_a_long_record_are_looked_at():
    """An hour moored, then a sortie: the profile is that of the sortie."""
    rest, sortie = straight(0.0, 0.0, 5000.0, rate=1.0).fixes(0.5, 1), turning(4.0, 1.0, 4000.0, rate=1.0).fixes(0.5, 2)
    columns = {name: np.r_[getattr(rest, name), getattr(sortie, name)] for name in ("latitude", "longitude")}
    both = steerway.Fixes(np.r_[rest.time, sortie.time + 5001.0], **columns)
    found, alone = choose_profile(both), choose_profile(sortie)
    assert 0.5 < expected(found, "fix_std") / expected(alone, "fix_std") < 2.0
    assert 0.2 < expected(found, "yaw_size") / expected(alone, "yaw_size") < 5.0

"""Filters aboard: the fixed-lag smoother against a whole record's and the truth; noise of which nothing is told."""

import math

import numpy as np
import pytest

import steerway
from steerway import InputError
from steerway.core import REJECTED
from steerway.estimation import FiveStateFilter, LearningFilter, Profile
from steerway.live.testing import Navigator, rows_of
from tests import scenes
from tests.command_line import run
from tests.scenes import angle_error, straight, turning

OTTER = Profile.named("otter")


def delayed(estimator, fixes):
    """(n,) times and (n, 9) outputs of a stream, the rest at its end too."""
    steps, rows = np.diff(fixes.time, prepend=fixes.time[0]), []
    for k, dt in enumerate(steps):
        estimator.row(dt, fixes.latitude[k], fixes.longitude[k])
        rows += [(fixes.time[k] - age, *values) for age, values in estimator.lagged()]
    rows += [(fixes.time[-1] - age, *values) for age, values in estimator.lagged(rest=True)]
    table = np.array(rows)
    return table[:, 0], table[:, 1:]


def test_with_a_lag_of_the_whole_record_it_is_the_whole_records_smoother():
    fixes, profile = turning(1.5, 0.4, 30.0, density=1e-3, decay=0.2).fixes(0.4, 81), scenes.small_craft()[2].profile
    time, values = delayed(FiveStateFilter(profile, lag=1e3), fixes)
    whole = FiveStateFilter(profile).smooth(fixes)
    rows = np.searchsorted(whole.time, time - 1e-6)
    late = time > fixes.time[0] + 10.0
    np.testing.assert_allclose(values[late, 2], whole.sog[rows][late], rtol=1e-7)
    np.testing.assert_allclose(values[late, 0], whole.latitude[rows][late], rtol=1e-12)
    np.testing.assert_allclose(values[late, 5], whole.sog_std[rows][late], rtol=1e-6)


def test_one_mode_is_smoothed_as_by_two_filters():
    """With fixes so good that both are linear about the same course."""
    fixes, profile = straight(3.0, 0.4, 40.0).fixes(0.02, 82), OTTER.model_copy(update={"position_std": 0.02})
    time, values = delayed(FiveStateFilter(profile, lag=1e3), fixes)
    whole = FiveStateFilter(profile).smooth(fixes)
    rows, middle = np.searchsorted(whole.time, time - 1e-6), (time > time[0] + 10.0) & (time < time[-1] - 10.0)
    apart = np.abs(values[:, 2] - whole.sog[rows])[middle] / whole.sog_std[rows][middle]
    assert apart.max() < 0.1
    np.testing.assert_allclose(values[middle, 5], whole.sog_std[rows][middle], rtol=0.02)


def errors(scene, profile, std, lag, seeds):
    """RMS of COG and SOG after 20 s, and the share of true courses within 2 σ."""
    found = []
    for seed in seeds:
        time, values = delayed(FiveStateFilter(profile, lag=lag), scene.fixes(std, seed))
        rows = np.searchsorted(scene.time, time - 1e-3)
        late = (time > scene.time[0] + 20.0) & (time < scene.time[-1] - 5.0)
        cog = angle_error(values[:, 3], scene.cog[rows])[late]
        sog, within = (values[:, 2] - scene.sog[rows])[late], cog < 2.0 * values[late, 6]
        found.append((np.nanmean(cog**2), np.nanmean(sog**2), within.mean()))
    cog, sog, within = np.mean(found, axis=0)
    return math.sqrt(cog), math.sqrt(sog), within


def test_a_second_of_delay_is_worth_a_fifth_of_the_courses_error():
    scene, profile = turning(1.3, 0.4, 120.0), OTTER.model_copy(update={"position_std": 0.5})
    (now, _, _), (second, _, within) = (errors(scene, profile, 0.5, lag, (83,)) for lag in (1e-3, 1.0))
    assert second < 0.8 * now and within > 0.9


def test_a_filter_that_begins_anew_gives_what_a_new_one_does():
    fixes, estimator = turning(1.3, 0.4, 20.0, rate=1.0).fixes(0.2, 85), FiveStateFilter(OTTER, lag=1.0)
    for k in range(10):
        estimator.row(7.0, fixes.latitude[k], fixes.longitude[k])
    estimator.reset()
    for again, new in zip(delayed(estimator, fixes), delayed(FiveStateFilter(OTTER, lag=1.0), fixes), strict=True):
        np.testing.assert_array_equal(again, new)


def test_fixes_that_are_taken_back_are_not_smoothed_by():
    fixes = turning(1.3, 0.4, 30.0).fixes(0.2, 84)
    (straight_on, again), outputs = (FiveStateFilter(OTTER, lag=1.0) for _ in range(2)), []
    for estimator in (straight_on, again):
        for k in range(100):
            estimator.row(0.2 if k else 0.0, fixes.latitude[k], fixes.longitude[k])
            estimator.lagged()
            if k == 80 and estimator is again:
                before = estimator.snapshot()
                estimator.row(0.2, fixes.latitude[90], fixes.longitude[90])
                estimator.restore(before)
        outputs.append([(age, *values) for age, values in estimator.lagged(rest=True)])
    np.testing.assert_array_equal(outputs[0], outputs[1])


def test_what_is_learned_loses_no_fix():
    fixes = turning(1.3, 0.4, 64.0).fixes(0.3, 85)
    learning = LearningFilter(background=False)
    learning.wait(2.0)
    time, _ = delayed(learning, fixes)
    assert learning.learned is not None
    np.testing.assert_allclose(np.diff(time), 0.2, atol=1e-3)


def test_live_gives_each_fix_late_and_all_at_the_end(tmp_path):
    fixes = turning(1.3, 0.4, 20.0).fixes(0.3, 86)
    navigator = Navigator(OTTER, lag=2.0)
    late = [(row.time, each.time) for row in rows_of({"": fixes}) for each in navigator.add(row)]
    assert all(now - of >= 2.0 - 1e-5 for now, of in late) and np.median(np.subtract(*zip(*late, strict=True))) < 2.01
    assert navigator.finish()[-1].time == pytest.approx(fixes.time[-1])
    with pytest.raises(InputError, match="lag is -1"):
        FiveStateFilter(lag=-1.0)
    settings = tmp_path / "boat.toml"
    settings.write_text('lag = 2.0\nrate = 5.0\nfrom = "file:none.nmea"\n', encoding="utf-8")
    code, _, said = run("live", settings)
    assert code == 2 and "--lag delays the row of every fix, expected neither" in said


MOST, REFUSED = 1.1, 0.01
"""Error over that of the paper's tuning, and share of good fixes that are refused."""
SETTLING = 20.0
"""s."""


def one_run(estimator, scene, fixes):
    """RMS of SOG (m/s) and COG (rad) after the start, and the share of refused fixes."""
    steps = np.diff(fixes.time, prepend=fixes.time[0]).tolist()
    rows = [estimator.row(*row) for row in zip(steps, fixes.latitude.tolist(), fixes.longitude.tolist(), strict=True)]
    sog, cog = np.array([values[2:4] for values, *_ in rows]).T
    late = fixes.time - fixes.time[0] > SETTLING
    known = np.isfinite(cog)
    assert known[late].mean() > 0.99
    squares = (sog - scene.sog)[late] ** 2, angle_error(cog, scene.cog)[late & known] ** 2
    refused = np.mean([status == REJECTED for *_, status in rows])
    return *(math.sqrt(each.mean()) for each in squares), refused


def beside_the_paper(scene, std, seeds, published="otter"):
    """Ratios of SOG and COG errors, of the paper's tuning told this noise, and the share of good fixes refused."""
    told = Profile.named(published).model_copy(update={"position_std": std})
    found = {
        kind: np.mean([one_run(FiveStateFilter(profile), scene, scene.fixes(std, seed)) for seed in seeds], axis=0)
        for kind, profile in {"told": told, "untold": None}.items()
    }
    return *found["untold"][:2] / found["told"][:2], found["untold"][2]


@pytest.mark.parametrize("std", [0.05, 0.35, 2.0])
def test_untold_noise_costs_nothing(std):
    sog, cog, refused = beside_the_paper(turning(1.3, 0.4, 90.0), std, (51,))
    assert sog < MOST and cog < MOST and refused < REFUSED


def test_a_whole_record_is_estimated_as_by_estimate():
    fixes = turning(1.3, 0.4, 30.0).fixes(1.0, 52)
    np.testing.assert_array_equal(FiveStateFilter().filter(fixes).sog, steerway.estimate(fixes, causal=True).sog)

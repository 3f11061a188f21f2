"""The main job on recorded logs, with the default and tuned on the log: against the receiver's own SOG and COG, which
are filtered and late, and against independent instruments: the yaw rate of a compass on a boat that sails a figure of
eight, and the inertial system of a ship."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import polars as pl
import pytest

import steerway
from steerway.core import OK, REJECTED, rms, wrap_array
from steerway.estimation import choose_profile
from steerway.estimation.testing import compare
from tests.golden import missed, no_worse
from tests.reference_outputs.cases.logs import LOGS

FIGURE8 = "furuno_scx20_n2k/furuno-130842-figure8-fast.raw"
COMPASS = "furuno_scx20_n2k/derived/furuno-130842-figure8-fast_scx20.csv"
SHIP = "palmer_seapath_truth/NBP1406_{}-2014-08-01"
MOORED = {"gps": "signalk_samples/gps.log", "ac42": "furuno_scx20_n2k/ac42-commissioning.raw"}


@dataclass(frozen=True)
class EstimatedLog:
    """Fixes, and what the default and tuning make of them, each found once."""

    fixes: steerway.Fixes

    @cached_property
    def profile(self):
        return choose_profile(self.fixes)

    @cached_property
    def tuned(self):
        return steerway.tune(self.fixes).profile

    @cached_property
    def _motions(self):
        return {}

    def estimate(self, smooth=False, tuned=False):
        """By the profile of the default, or by the tuned one."""
        if (smooth, tuned) not in self._motions:
            profile = self.tuned if tuned else self.profile
            self._motions[smooth, tuned] = steerway.estimate(self.fixes, profile, smooth=smooth)
        return self._motions[smooth, tuned]

    @cached_property
    def agreement(self):
        """How the causal default agrees with the receiver."""
        return compare(self.fixes, self.estimate())


@pytest.fixture(scope="module")
def logs(shared_data):
    """The logs with positions by name; what is found of one is kept for all tests of this file."""
    return {name: EstimatedLog(steerway.read(shared_data / "data" / name)) for name in LOGS}


@pytest.fixture(scope="module")
def field(logs, shared_data):
    """Errors against independent instruments, by name; of tuned profiles by ("tuned", name)."""
    numbers = turns(logs, shared_data) | ship(logs)
    for key, name in MOORED.items():
        found = logs[name].agreement
        numbers |= {f"standstill_{key}_sog_median_mps": found.standstill_sog_median}
        numbers |= {f"standstill_{key}_undefined_pct": 100.0 * found.standstill_undefined}
    return numbers


def turns(logs, shared_data):
    """Course rate against the compass's yaw rate over one second; the lag is the smoothed estimate's."""
    table = pl.read_csv(shared_data / "data" / COMPASS)
    time, rate = table["t"].to_numpy(), table["p9_rot_dps_1s"].to_numpy()

    def error(motion, lag):
        return rms(np.degrees(motion.course_rate) - np.interp(motion.time - lag, time, rate))

    log = logs[FIGURE8]
    lags = np.arange(0.0, 5.0, 0.01)
    lag = float(lags[np.argmin([error(log.estimate(smooth=True), each) for each in lags])])
    numbers = {"figure8_receiver_lag_s": lag}
    for words in ("", "_smoothed"):
        plain, tuned = (log.estimate(bool(words), each) for each in (False, True))
        numbers[f"figure8_rate_rms{words}_dps"] = error(plain, 0.0)
        numbers[f"figure8_rate_rms{words}_aligned_dps"] = error(plain, lag)
        numbers["tuned", f"figure8_rate_rms{words}_dps"] = error(tuned, 0.0)
    return numbers


def ship(logs):
    """The ship's receivers against its inertial system, all on the clock that they state."""
    truth, numbers = logs[SHIP.format("s330")].fixes, {}
    known = truth.rows(np.isfinite(truth.sog) & np.isfinite(truth.cog))
    for receiver in ("s330", "seap", "gp02", "pcod"):
        for tuned in (False, True):
            motion = logs[SHIP.format(receiver.replace("pcod", "PCOD"))].estimate(tuned=tuned)
            there = (motion.time >= truth.time[0]) & (motion.time <= truth.time[-1]) & np.isfinite(motion.cog)
            motion = motion.rows(there)
            sog = motion.sog - np.interp(motion.time, known.time, known.sog)
            cog = wrap_array(motion.cog - np.interp(motion.time, known.time, np.unwrap(known.cog)))
            found = {f"{receiver}_sog_rms_mps": rms(sog), f"{receiver}_cog_rms_deg": math.degrees(rms(cog))}
            numbers |= {("tuned", key) if tuned else key: number for key, number in found.items()}
    return numbers


@pytest.mark.study
def test_ship_in_swell_against_her_inertial_system(logs):
    log = logs["palmer_seapath_truth/NBP1406_s330-2014-08-01"]
    found = compare(log.fixes, steerway.estimate(log.fixes, log.tuned, smooth=True))
    assert found.sog_rms <= 0.021
    assert math.degrees(found.cog_rms) <= 0.19


@pytest.mark.study
def test_nine_hours_under_way_against_the_receiver(logs):
    """Waves swing the antenna; what swings is no motion of the vessel."""
    log = logs["rob_atlantic_1hz/kernevel_latrinite.nmea"]
    found = compare(log.fixes, log.estimate(smooth=True))
    assert found.sog_rms_aligned <= 0.09
    assert math.degrees(found.cog_rms_aligned) <= 2.4
    found = compare(log.fixes, log.estimate())
    assert found.sog_rms <= 0.108
    assert math.degrees(found.cog_rms) <= 2.9


def test_a_start_from_rest_converges_to_the_right_course(shared_data):
    """A bare filter ends 180° off on this log."""
    log = EstimatedLog(steerway.read(shared_data / "data" / "rob_atlantic_1hz" / "gx_to_gavres.nmea"))
    for smooth in (False, True):
        found = compare(log.fixes, log.estimate(smooth))
        assert math.degrees(found.cog_rms) < 4.0
        assert found.sog_rms < 0.15


MOST = {
    "figure8_rate_rms_dps": 0.545,
    "figure8_rate_rms_smoothed_dps": 0.36,
    "figure8_rate_rms_aligned_dps": 0.335,
    "figure8_rate_rms_smoothed_aligned_dps": 0.21,
    "s330_sog_rms_mps": 0.035,
    "s330_cog_rms_deg": 0.45,
    "seap_sog_rms_mps": 0.05,
    "seap_cog_rms_deg": 0.5,
    "standstill_gps_sog_median_mps": 0.15,
    "standstill_ac42_sog_median_mps": 0.15,
}
ATHWART = "9 mm athwart, below the noise of a fix, are as likely yaw as motion of the antenna"
MISSES = {
    "figure8_rate_rms_smoothed_dps": (0.394, f"0.393 °/s: {ATHWART}"),
    "figure8_rate_rms_smoothed_aligned_dps": (0.241, f"0.240 °/s: {ATHWART}"),
    "standstill_gps_sog_median_mps": (0.174, "0.173 m/s: a receiver that swings; its own SOG is 0.165"),
}
"""What is missed, at most, and why."""
CASES = [pytest.param(key, marks=missed(MISSES[key][1])) if key in MISSES else key for key in MOST]


@pytest.mark.study
@pytest.mark.parametrize("key", CASES)
def test_independent_truth_on_recorded_logs(field, key):
    no_worse(field[key] <= MISSES.get(key, (math.inf,))[0], field[key])
    assert field[key] <= MOST[key]


@pytest.mark.study
@missed("2.33 s: a smoothed estimate by another maximum of the fit; the error is flat there")
def test_the_lag_of_the_figure_of_eight_is_found(field):
    no_worse(2.3 < field["figure8_receiver_lag_s"] < 3.2, field["figure8_receiver_lag_s"])
    assert 2.4 < field["figure8_receiver_lag_s"] < 3.2  # the error is flat from 2.5 to 3.2 s


@pytest.mark.study
@missed("82.6 % of rows: a slow error taken for motion")
def test_at_a_standstill_there_is_no_course(field):
    found = min(field[f"standstill_{key}_undefined_pct"] for key in MOORED)
    no_worse(found > 82.5, found)
    assert found >= 95.0


def mirrored(fixes, motion):
    """Rows in runs of ten seconds and more that run against the receiver's course, where it has way."""
    reports = fixes.rows(fixes.has_position)
    wrong = (reports.sog > 1.0) & (np.abs(wrap_array(motion.cog - reports.cog)) > math.radians(135.0))
    edges = np.flatnonzero(np.diff(np.r_[False, wrong, False])).reshape(-1, 2)
    return sum(j - i for i, j in edges if reports.time[j - 1] - reports.time[i] >= 10.0)


@pytest.mark.study
def test_no_log_is_mirrored_and_every_innovation_is_as_expected(logs):
    counted = 0
    for name, log in logs.items():
        if log.agreement.compared < 100 or name.endswith(".nm4"):  # which has one fix a vessel
            continue
        motion = log.estimate()
        judged = motion.rows(np.isin(motion.status, (OK, REJECTED)) & np.isfinite(motion.nis))
        assert 0.2 < np.median(judged.nis) < 3.0, name
        assert np.mean(judged.status == REJECTED) < 0.06 or "pyais" in name, name
        if log.fixes.mmsi is None:
            counted += 1
            assert mirrored(log.fixes, motion) == 0, name
    assert counted >= 15


@pytest.mark.study
def test_the_default_is_as_good_as_tuning(field):
    tuned = {key[1]: number for key, number in field.items() if key[0] == "tuned"}
    assert len(tuned) == 10 and not {key for key, number in tuned.items() if field[key] >= 1.1 * number}


@pytest.mark.study
def test_every_log_runs_through(logs):
    """No traceback, a row for every fix that was read, course either known or said to be undefined."""
    assert len(logs) >= 34
    for name, log in logs.items():
        for smooth in (False, True):
            motion = log.estimate(smooth)
            assert len(motion) == log.fixes.has_position.sum(), name
            assert not (motion.sog < 0.0).any(), name
            unknown = np.isnan(motion.cog)
            assert (motion.status[unknown] >= 2).all(), name
            known = motion.rows(~unknown)
            for column in (known.sog, known.course_rate, known.sog_std, known.cog_std, known.course_rate_std):
                assert np.isfinite(column).all(), name

"""The whole-record estimate: its rows and columns, rate, long intervals and episodes; and what every smoother owes."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

import steerway
from steerway.core import OK, REJECTED, Fixes, InputError
from steerway.core.testing import STARTING, displaced_all
from steerway.estimation import FiveStateFilter, Profile
from steerway.report.testing import DISAGREES, GAP, REFUSED, RESTARTED, episodes_of
from steerway.sensors import Gnss
from steerway.sensors.testing import Fault
from steerway_studies.testing import CELLS, TrueMotion, errors
from tests.command_line import run
from tests.scenes import angle_error, straight, turning

SMALL = Profile(speed_noise=1e-3, course_rate_noise=2e-3, course_rate_decay=0.3, position_std=0.5)
COLUMNS = (
    "time_s lat_deg lon_deg sog_mps cog_deg course_rate_dps sog_std_mps cog_std_deg course_rate_std_dps "
    "position_std_m position_relative_std_m nis status"
).split()


def test_columns_and_ranges():
    frame = steerway.estimate(turning(1.3, 3.0, 120.0).fixes(0.5, 1), SMALL, causal=True).to_frame()
    assert frame.columns == COLUMNS
    assert frame["cog_deg"].drop_nulls().is_between(0.0, 360.0, closed="left").all()
    undefined = frame.filter(frame["cog_deg"].is_null())
    assert set(undefined["status"]) <= {"starting", "no_course", "rejected"}
    assert undefined["course_rate_dps"].null_count() == len(undefined)


def test_vessels_are_estimated_each_for_itself():
    one, two = turning(5.0, 0.3, 300.0, rate=0.2).fixes(5.0, 1), turning(8.0, 2.0, 300.0, rate=0.1).fixes(5.0, 2)
    mmsi = np.r_[np.full(len(one), 257000001), np.full(len(two), 219000002)]
    columns = {name: np.r_[getattr(one, name), getattr(two, name)] for name in ("time", "latitude", "longitude")}
    fleet = steerway.estimate(Fixes(**columns, mmsi=mmsi), "ais", causal=True)
    assert fleet.to_frame().columns == ["mmsi", *COLUMNS]
    alone = steerway.estimate(replace(one, mmsi=mmsi[: len(one)]), "ais", causal=True)
    np.testing.assert_array_equal(fleet.rows(fleet.mmsi == 257000001).sog, alone.sog)


def test_what_cannot_be_estimated_is_refused():
    """A log that tells nothing, a path, and unknown names, which are answered with the known ones."""
    for call, message in {
        lambda: steerway.tune(straight(0.0, 0.0, 20.0).fixes(0.1, 1)): "of 101 fixes are under way",
        lambda: steerway.estimate("sortie.nmea"): r"given as str, expected Fixes, as steerway.read\(path\)",
        lambda: FiveStateFilter("otterr"): "otter, mariner-usv, simulated-otter, small-usv, sailing-yacht, swell, ship",
        lambda: FiveStateFilter("otter", aid=("compass",)): "sog, cog, heading, water_speed, yaw_rate",
    }.items():
        with pytest.raises(steerway.InputError, match=message):
            call()


def test_at_rest_few_steps_are_many():
    """A hundredth of a deviation here too, though at rest the model is least linear."""
    k = np.arange(5)
    places = displaced_all(0.9, 0.2, 5.0 * (k % 2), 3.0 * (k % 3))
    rest = Fixes(180.0 * k, *places, mmsi=np.full(5, 257000001))
    at_once, in_steps = (FiveStateFilter("ais").filter(rest, rate) for rate in (None, 1.0))
    in_steps = in_steps.rows(np.isin(in_steps.time, rest.time))
    assert np.isnan(at_once.cog).all(), "she may go either way"
    assert np.nanmax(np.abs(at_once.sog - in_steps.sog) / at_once.sog_std) < 0.01
    assert np.nanmax(at_once.sog) < 0.1
    for name in ("sog_std", "position_std"):
        np.testing.assert_allclose(getattr(at_once, name), getattr(in_steps, name), rtol=0.01, err_msg=name)


PROFILE = steerway.Profile.named("small-usv").model_copy(update={"position_std": 0.3})


def scene():
    return turning(1.5, 0.7, 200.0, seed=2)


def estimated():
    fixes = scene().fixes(0.3, 2)
    return fixes, steerway.estimate(fixes, PROFILE, causal=True)


def test_refused_fixes_in_a_row_are_one_episode():
    fixes, motion = estimated()
    status = np.where(motion.status == REJECTED, OK, motion.status)
    status[[300, 301, 303, 500]] = REJECTED
    found = episodes_of(fixes, replace(motion, status=status))
    assert [(each.kind, each.rows) for each in found] == [(REFUSED, 3), (REFUSED, 1)]
    assert (found[0].start, found[0].stop) == (motion.time[300], motion.time[303])


def test_a_gap_and_the_restart_after_it():
    fixes, _ = estimated()
    late = replace(fixes, time=np.where(np.arange(len(fixes)) < 500, fixes.time, fixes.time + 4000.0))
    motion = steerway.estimate(late, PROFILE, causal=True)
    assert motion.status[0] == STARTING and motion.status[499] == OK
    found = [each for each in episodes_of(late, motion) if each.kind != REFUSED]
    assert [each.kind for each in found] == [GAP, RESTARTED], "the start itself is none"
    assert found[0].stop - found[0].start == pytest.approx(4000.2)


def test_an_estimate_that_does_not_follow_disagrees():
    """Ten seconds of a speed that is 2 m/s too high."""
    fixes, motion = estimated()
    wrong = np.zeros(len(fixes))
    wrong[400:450] = 2.0
    found = episodes_of(fixes, replace(motion, sog=motion.sog + wrong))
    found = [each for each in found if each.kind != REFUSED]
    assert [each.kind for each in found] == [DISAGREES]
    assert motion.time[400] <= found[0].start <= motion.time[410]
    assert motion.time[445] <= found[0].stop <= motion.time[460]


@pytest.mark.parametrize("suffix", ["csv", "json"])
def test_the_command_writes_them(tmp_path, suffix):
    log, out = tmp_path / "sortie.csv", tmp_path / f"episodes.{suffix}"
    fixes, _ = estimated()
    late = replace(fixes, time=np.where(np.arange(len(fixes)) < 500, fixes.time, fixes.time + 100.0))
    late.to_frame().write_csv(log)
    code, printed, _ = run("estimate", log, "--profile", "small-usv", "--episodes", out)
    assert code == 0 and "1 × gap" in printed and f"wrote {out}" in printed
    rows = list(csv.DictReader(out.open())) if suffix == "csv" else json.loads(out.read_text())
    assert any(row["kind"] == GAP and float(row["duration_s"]) == pytest.approx(100.2) for row in rows)
    code, _, message = run("estimate", log, "--episodes", tmp_path / "episodes.txt")
    assert code == 2 and "expected .csv or .json" in message


def test_a_fix_on_another_sea_moves_no_smoothed_row():
    fixes = turning(2.0, 0.5, 60.0).fixes(0.3, 1)
    longitude = fixes.longitude.copy()
    longitude[150] += 1.0  # rad
    true, found = (steerway.estimate(each, "small-usv") for each in (fixes, replace(fixes, longitude=longitude)))
    assert abs(found.longitude[150] - true.longitude[150]) < 1e-6
    assert abs(angle_error(found.cog[150], true.cog[150])) < 0.3


ENDS = 100
"""Rows at both ends that count for nothing: there the filter from the past, or the one from the future, begins."""
MIDDLE = slice(ENDS, -ENDS)
PROFILES = {
    "two motion models": {},
    "one motion model": None,
    "slow error of the receiver": {"error_std": 0.3, "error_time": 20.0},
}


def profile_of(name, kind):
    """The true parameters of a cell; those of the average; or with an error of the receiver that she does not have."""
    profile = CELLS[name].profile
    return profile.on_average if PROFILES[kind] is None else profile.model_copy(update=PROFILES[kind])


def output(motion):
    """(3, n) SOG, COG and course rate."""
    return np.stack([motion.sog, motion.cog, motion.course_rate])


def deviations(motion):
    return np.stack([motion.sog_std, motion.cog_std, motion.course_rate_std])


@pytest.mark.parametrize("kind", PROFILES)
def test_smoothed_is_better_and_surer_than_causal(kind):
    profile = profile_of("o05", kind)
    squares, variances = [], []
    for seed in range(3):
        voyage, fixes = CELLS["o05"].sailed(seed)
        both = [steerway.estimate(fixes, profile, smooth=smooth) for smooth in (False, True)]
        found = [np.square(errors(*output(each), voyage))[:, MIDDLE] for each in both]
        squares.append(np.nanmean(found, axis=2))
        variances.append(np.nanmean([deviations(each)[:, MIDDLE] ** 2 for each in both], axis=2))
    squares, variances = np.array(squares), np.array(variances)
    causal, smoothed = np.sqrt(squares.mean(axis=0))
    assert np.all(smoothed < 0.85 * causal)
    assert np.all(squares[:, 1] < squares[:, 0]), "in every single voyage"
    assert np.all(variances[:, 1] < variances[:, 0])


def test_a_record_is_smoothed_unless_causal_is_asked_for():
    _, fixes = CELLS["o05"].sailed(0)
    profile = CELLS["o05"].profile
    by_default, smoothed = steerway.estimate(fixes, profile), steerway.estimate(fixes, profile, smooth=True)
    causal, not_smoothed = (
        steerway.estimate(fixes, profile, causal=True),
        steerway.estimate(fixes, profile, smooth=False),
    )
    np.testing.assert_array_equal(output(by_default), output(smoothed))
    np.testing.assert_array_equal(output(causal), output(not_smoothed))
    np.testing.assert_array_equal(output(causal), output(FiveStateFilter(profile).filter(fixes)))
    assert not np.array_equal(causal.sog, smoothed.sog, equal_nan=True)
    with pytest.raises(InputError, match="causal and smooth are both true"):
        steerway.estimate(fixes, profile, causal=True, smooth=True)


O05 = CELLS["o05"]


def root_mean_square(motion, voyage):
    """(3,) of the errors of SOG, COG and course rate after the first half minute."""
    found = errors(*output(motion), voyage)[:, voyage.time > 30.0]
    return np.sqrt(np.mean(np.square(found), axis=1))


FAULTS = {
    "no fixes for 30 s": {"kind": "dropout", "duration": 30.0},
    "one fix 50 m off": {"kind": "jump", "size": 50.0},
    "fixes 50 m off for 5 s": {"kind": "jump", "size": 50.0, "duration": 5.0},
    "every later fix 10 m off": {"kind": "step", "size": 10.0},
}
"""Faults that begin at 150 s."""


@pytest.mark.parametrize("fault", FAULTS)
def test_troubles_cost_next_to_nothing(fault):
    voyage, _ = O05.sailed(1)
    gnss = {"rate": O05.scenario.rate, "white": O05.position_std}
    # In good fixes the fault begins after their end, so that the noise is the same.
    good, disturbed = (
        voyage.fixes(Gnss(**gnss, faults=[Fault(start=start, **FAULTS[fault])]), 1) for start in (1e9, 150.0)
    )
    chosen = np.isin(voyage.time, disturbed.time)
    there = TrueMotion(**{name: getattr(voyage, name)[chosen] for name in voyage.__dataclass_fields__})
    usual, troubled = (
        root_mean_square(steerway.estimate(given, O05.profile, smooth=True), truth)
        for given, truth in ((good, voyage), (disturbed, there))
    )
    assert np.all(troubled < 1.3 * usual)

"""Episodes of an estimate: what they are, and their files."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

import steerway
from steerway.core import OK, REJECTED
from steerway.core.testing import STARTING
from steerway.report.testing import DISAGREES, GAP, REFUSED, RESTARTED, episodes_of
from tests.command_line import run
from tests.scenes import turning

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


def test_info_lists_the_models(tmp_path):
    log = tmp_path / "sortie.csv"
    fixes, _ = estimated()
    fixes.rows(slice(300)).to_frame().write_csv(log)
    code, printed, _ = run("info", log, "--models")
    assert code == 0 and "log evidence" in printed
    (found,) = json.loads(run("info", log, "--models", "--json")[1])
    assert sum(each["weight"] for each in found["inferred"]["models"]) == pytest.approx(1.0)
    assert found["inferred"]["fixes"] == 300 and len(found["inferred"]["models"]) >= 3

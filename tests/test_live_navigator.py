"""The estimate aboard equals `estimate` on the recorded log, also with rows that are late, out of order or foreign."""

import asyncio
import math

import numpy as np
import pytest

from steerway.core import Fixes, InputError
from steerway.estimation import estimate
from steerway.formats.testing import read, survey
from steerway.live.testing import FixClock, InputRow, Navigator, Service, TableFile, rows_of
from tests.kept_outputs import Kept, assert_equal, first_of_each
from tests.scenes import turning


def replayed(recorded, rate=None, **settings):
    """(rows at the fixes, rows at the ticks) of a replay."""
    kept = Kept()
    service = Service(Navigator("small-usv", rate=rate, **settings), [kept], rate or 50.0)
    asyncio.run(service.replay(rows_of(recorded)))
    return kept.fixes, kept.ticks


@pytest.fixture(scope="module")
def fixes():
    return turning(2.0, 0.5, 60.0).fixes(0.3, 1)


def received_from(fixes, source="GP"):
    return list(rows_of({source: fixes}))


@pytest.mark.parametrize("rate", [None, 3.0])
def test_a_replay_is_the_estimate(fixes, rate):
    """With two receivers: only one receiver's fixes are used."""
    other = Fixes(fixes.time + 0.05, fixes.latitude + 1e-6, fixes.longitude)
    at_fixes, at_ticks = replayed({"GP": fixes, "GN": other}, rate, sources=("GP",))
    assert_equal(at_fixes if rate is None else at_ticks, estimate(fixes, "small-usv", rate=rate, causal=True))


@pytest.mark.parametrize(
    ("log", "source", "rate"),
    [
        ("signalk_samples/gps.log", "GP", None),
        ("rob_atlantic_1hz/gx_to_gavres.nmea", "GN", 10.0),
        ("rob_atlantic_1hz/nukuhiva_multitalker.nmea", None, None),
    ],
)
def test_a_replay_of_a_recorded_log_is_the_estimate(shared_data, log, source, rate):
    path = shared_data / "data" / log
    sources = survey(path)[0].recording.sources
    source = source or read(path).source
    at_fixes, at_ticks = replayed(sources, rate, sources=(source,), max_dead_reckoning=1800.0)
    fixes = read(path, source=source)
    motion = estimate(fixes, "small-usv", rate=rate, causal=True)
    if rate is None:
        assert_equal(at_fixes, motion.rows(first_of_each(fixes)))
    else:
        assert_equal(at_ticks, motion)


def test_late_and_disordered_fixes_are_taken_at_their_own_time(fixes):
    in_order, late = Navigator(), Navigator()
    rows = received_from(fixes)
    for received in rows:
        in_order.add(received)
    shuffled = list(rows)
    for k in range(10, len(rows) - 4, 7):  # every seventh row comes three rows late
        shuffled[k : k + 4] = [*rows[k + 1 : k + 4], rows[k]]
    for received in shuffled:
        late.add(received)
    assert late.counts["late"] > 20 and late.counts["too late"] == 0
    end = fixes.time[-1] + 0.2
    np.testing.assert_allclose(late.at(end)[:-2], in_order.at(end)[:-2], rtol=1e-12)
    late.add(rows[3])
    assert late.counts["too late"] == 1
    np.testing.assert_allclose(late.at(end)[:-2], in_order.at(end)[:-2], rtol=1e-12)


def test_a_gap_in_a_log_that_is_played_in_haste_is_no_step(fixes):
    rows = received_from(fixes)
    kept = rows[:150] + rows[200:]
    hasty, output = Navigator("small-usv"), []
    clock = FixClock()
    for k, received in enumerate(kept):
        output += hasty.add(received, clock.now(0.02 * k))
        clock.add(received.time, 0.02 * k)
    assert hasty.counts["clock steps"] == 0
    assert_equal(output, estimate(fixes.rows(np.r_[0:150, 200 : len(fixes)]), "small-usv", causal=True))


def test_an_instrument_of_another_clock_does_not_carry_the_boat_away(fixes):
    navigator = Navigator(aid=("yaw_rate",))
    rows = received_from(fixes)
    for received in rows[:150]:
        navigator.add(received, received.time)
        navigator.add(InputRow("gyro", received.time + 500.0, yaw_rate=0.0), received.time)
    assert navigator.counts["used"] == 150 and navigator.counts["stray"] == 150
    assert navigator.at(rows[149].time).valid


def test_the_clock_goes_by_the_least_delayed_fix():
    clock = FixClock()
    assert math.isnan(clock.now(5.0))
    for k, delay in enumerate((0.3, 0.1, 0.9, 0.2)):
        clock.add(1000.0 + k, 50.0 + k + delay)
    assert clock.now(60.0) == pytest.approx(1009.9)
    assert FixClock(0.2).latency == 0.2
    for k in range(60):
        clock.add(1100.0 + k, 160.0 + k)  # ten seconds later than before: the old offset counts until its window ends
    assert clock.now(220.0) == pytest.approx(1160.0)


def test_a_table_that_was_cut_off_is_continued(fixes, tmp_path):
    out = tmp_path / "run.csv"
    navigator = Navigator("small-usv")
    rows = [row for received in received_from(fixes) for row in navigator.add(received)]
    first, second = TableFile(out), TableFile(out)
    for row in rows[:100]:
        first.fix(row)
    first._sink.close()  # as if the process had ended
    with open(f"{out}.part", "ab") as part:
        part.write(b"torn")
    for row in rows[100:]:
        second.fix(row)
    second.close()
    import polars as pl

    assert pl.read_csv(out)["time_s"].to_list() == [row.time for row in rows]
    assert [each.name for each in tmp_path.iterdir()] == ["run.csv"]
    with pytest.raises(InputError, match="folder"):
        TableFile(tmp_path / "nowhere" / "run.csv")

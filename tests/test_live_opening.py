"""A live run gives the estimate of the recorded log, from its start on and with rows that are late or foreign."""

import asyncio
import json
import math
import re

import numpy as np
import pytest

from steerway.core import REJECTED, InputError
from steerway.core.testing import iso
from steerway.estimation import estimate
from steerway.formats.testing import nmea0183, read, survey, ubx
from steerway.live import testing as live
from tests import hastened
from tests.kept_outputs import Kept, assert_equal, first_of_each, stopped_after
from tests.messages import pvt
from tests.scenes import turning
from tests.sentences import START, gga, rmc, track


def received(epochs, sources=()):
    """Rows of a service whose link delivers epochs, one a second, in pieces."""
    kept = Kept()

    async def receives(deliver):
        feed = live.Feed(live.ReceiverDecoder(), deliver)
        for epoch in epochs:
            parts = [epoch[k : k + 37] for k in range(0, len(epoch), 37)]
            for part in parts:
                feed.feed(part)
                await asyncio.sleep(1.0 / len(parts))
        await asyncio.sleep(1.0)

    hastened.run(stopped_after(live.Service(live.Navigator("small-usv", sources=sources), [kept]), receives))
    return kept.fixes


def test_a_plotter_that_stamps_two_positions_with_one_second(shared_data):
    """RMC of a Zeus plotter has the position of the second before. `estimate` uses RMC, and so does `live`."""
    path = shared_data / "data" / "gpsd_logs" / "bundg_zeus_9.log"
    rows = received(re.split(rb"(?=\$GPGGA)", path.read_bytes()))
    fixes = read(path)
    motion = estimate(fixes, "small-usv", causal=True).rows(first_of_each(fixes))
    assert fixes.source == "GP RMC" and len(rows) >= len(motion) - 1
    assert_equal(rows, motion.rows(slice(0, len(rows))))


@pytest.mark.parametrize("source", ["UBX", "GP"])
def test_ubx_and_sentences_mixed_on_a_link(source):
    """Both for the same epochs, with some messages of each kind damaged."""
    places = list(zip(*track(40), strict=True))
    frames, lines = [pvt(*place, start=0.0) for place in places], [rmc(*place) + gga(*place) for place in places]
    frames[20], lines[13] = frames[20][:50], lines[13][:50]
    epochs = [frame + line for frame, line in zip(frames, lines, strict=True)]
    expected = {**ubx.read(b"".join(epochs)).sources, **nmea0183.read(b"".join(epochs)).sources}[source]
    assert len(expected) >= 39
    assert_equal(received(epochs, (source,)), estimate(expected, "small-usv", causal=True))


def test_a_position_that_another_formatter_gave_before_a_pause_is_not_lost():
    """RMC first has the position of the second before, later GGA's own position, with a pause between the two."""
    places, used = list(zip(*track(40), strict=True)), []
    decoder, opening = live.ReceiverDecoder(), live.StartupBuffer(("GP RMC",))
    for k, (place, before) in enumerate(zip(places[1:], places, strict=False)):
        rows = decoder.feed(gga(*place)) + (decoder.complete_on_silence() if k > 30 else [])
        rows += decoder.feed(rmc(*(place if k > 30 else (place[0], *before[1:])))) + decoder.complete_on_silence()
        used += opening.add_rows(rows, float(k))
    times = [row.time for row, _ in used if row.source == "GP RMC" and row.has_position]
    assert opening.chosen == "GP RMC" and times == [place[0] for place in places[1:]]


def test_a_source_that_does_not_exist_is_refused_with_those_that_do():
    epochs = [gga(*place) + rmc(*place) for place in zip(*track(40), strict=True)]
    with pytest.raises(ExceptionGroup) as refused:
        received(epochs, sources=("GX",))
    assert "source 'GX' sends no position; the sources with positions are 'GP'" in str(refused.value.exceptions)


def opened(rows, pace=0.2, wanted=()):
    opening = live.StartupBuffer(wanted)
    return opening, [each for k, row in enumerate(rows) for each in opening.add_rows([row], k * pace)]


def row_of(time, source="GP", **more):
    return live.InputRow(source, START + time, math.radians(54.0) + 1e-7 * time, math.radians(10.0), **more)


def counts(rows, pace, *numbers):
    """How many of the first so many rows are used."""
    return [len(opened(rows[:n], pace)[1]) for n in numbers]


def test_the_only_source_is_used_after_three_epochs_and_half_a_second_and_a_single_fix_in_the_end():
    rows = [row_of(0.2 * k) for k in range(6)]
    opening, used = opened(rows)
    assert opening.chosen == "GP" and [row for row, _ in used] == rows
    assert [arrived for _, arrived in used] == pytest.approx([0.2 * k for k in range(6)])
    assert counts(rows, 0.2, 3, 4) == [0, 4]
    assert counts([row_of(0.5 * k) for k in range(6)], 0.5, 2, 3) == [0, 3]
    opening, used = opened([row_of(0.0)])
    assert used == [] and opening.take_ready(9.9) == []
    assert [row for row, _ in opening.take_ready(10.0)] == [row_of(0.0)]


def test_of_two_sources_the_better_one_is_used_whichever_comes_first():
    slow = [row_of(float(k), "GP") for k in range(12)]
    fast = [row_of(0.05 + 0.2 * k, "GN") for k in range(60)]
    rows = sorted(slow + fast, key=lambda row: row.time)
    opening, used = opened(rows, 0.17)
    assert opening.chosen == "GN" and [row for row, _ in used] == rows
    assert opened(rows, 0.17, ("GP",))[0].chosen == "GP"
    alike = [row_of(0.2 * (k // 2) + 0.05 * (k % 2), ("GP", "GN")[k % 2]) for k in range(30)]
    assert counts(alike, 0.1, 19, 20) == [0, 20], "ten epochs of each are compared"
    for last, used in ((9.9, 0), (10.0, 3)):
        assert counts([row_of(0.0), row_of(0.05, "GN"), row_of(last)], 0.01, 3) == [used], "a log in haste"


def test_rows_before_the_first_date_get_it():
    decoder, opening, used = live.ReceiverDecoder(), live.StartupBuffer(), []
    for k, place in enumerate(zip(*track(8), strict=True)):
        rows = decoder.feed(gga(*place)) if k < 1 else decoder.feed(gga(*place) + rmc(*place))
        used += opening.add_rows(rows + decoder.complete_on_silence(), float(k))
    assert [row.time for row, _ in used] == pytest.approx([START + k for k in range(8)], abs=0.0)


def test_two_receivers_of_one_talker_are_two_sources():
    here, there = (54.0, 10.0), (54.001, 10.0)
    decoder, opening, used = live.ReceiverDecoder(), live.StartupBuffer(), []
    for k in range(30):
        first, second = ((here, there), (there, here))[k % 2]
        rows = decoder.feed(rmc(START + k, *first)) + decoder.feed(rmc(START + k, *second))
        used += opening.add_rows(rows, float(k))
    latitudes = {source: {row.latitude for row, _ in used if row.source == source} for source in ("GP", "GP 2")}
    assert all(len(each) == 1 for each in latitudes.values()) and latitudes["GP"] != latitudes["GP 2"]


def tpv(time, latitude, **more):
    return {"class": "TPV", "device": "/dev/a", "mode": 3, "time": iso(time), "lat": latitude, "lon": 10.0} | more


def test_gpsd_reports_a_position_once_an_epoch():
    decoder, rows = live.GpsdDecoder(), []
    for k in range(44):
        for each in (tpv(START + k, 54.0 + 1e-5 * k), tpv(START + k, 54.0 + 1e-5 * k, speed=2.0)):
            rows += decoder.feed(json.dumps(each).encode() + b"\n")
        rows += decoder.complete_on_silence()
        for step in (0.5, 1.0, 1.0):  # sentences of the same second, later and with another position
            rows += decoder.feed(json.dumps(tpv(START + k, 54.0 + 1e-5 * (k + step))).encode() + b"\n")
    placed = [row for row in rows if row.has_position]
    assert [row.time for row in placed] == [START + k for k in range(44)]
    assert all(row.sog == 2.0 for row in placed)
    navigator = live.Navigator("small-usv")
    estimates = [each for row in rows for each in navigator.add(row)]
    assert len(estimates) == 44 and all(row.status != REJECTED for row in estimates)


def test_one_receiver_behind_gpsd_is_read_as_it_is():
    decoder = live.GpsdDecoder()
    device = {"class": "DEVICE", "path": "/dev/a", "driver": "NMEA0183"}
    assert decoder.feed(json.dumps({"class": "DEVICES", "devices": [device]}).encode() + b"\n") == []
    assert json.loads(decoder.request.partition(b"=")[2]) == {
        "enable": True, "json": False, "raw": 2, "device": "/dev/a"
    }  # fmt: skip
    decoder.feed(gga(START, 54.0, 10.0) + rmc(START, 54.0, 10.0))
    (row,) = decoder.complete_on_silence()
    assert row.source == "GP" and row.time == START
    several = live.GpsdDecoder()
    for _ in range(2):
        both = [device, device | {"path": "/dev/b"}]
        several.feed(json.dumps({"class": "DEVICES", "devices": both}).encode() + b"\n")
    assert several.request == b""


def replayed(recorded, rate=None, **settings):
    """(rows at the fixes, rows at the ticks) of a replay."""
    kept = Kept()
    service = live.Service(live.Navigator("small-usv", rate=rate, **settings), [kept], rate or 50.0)
    asyncio.run(service.replay(live.rows_of(recorded)))
    return kept.fixes, kept.ticks


@pytest.fixture(scope="module")
def fixes():
    return turning(2.0, 0.5, 60.0).fixes(0.3, 1)


def received_from(fixes, source="GP"):
    return list(live.rows_of({source: fixes}))


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
    in_order, late = live.Navigator(), live.Navigator()
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
    hasty, output = live.Navigator("small-usv"), []
    clock = live.FixClock()
    for k, received in enumerate(kept):
        output += hasty.add(received, clock.now(0.02 * k))
        clock.add(received.time, 0.02 * k)
    assert hasty.counts["clock steps"] == 0
    assert_equal(output, estimate(fixes.rows(np.r_[0:150, 200 : len(fixes)]), "small-usv", causal=True))


def test_an_instrument_of_another_clock_does_not_carry_the_boat_away(fixes):
    navigator = live.Navigator(aid=("yaw_rate",))
    rows = received_from(fixes)
    for received in rows[:150]:
        navigator.add(received, received.time)
        navigator.add(live.InputRow("gyro", received.time + 500.0, yaw_rate=0.0), received.time)
    assert navigator.counts["used"] == 150 and navigator.counts["stray"] == 150
    assert navigator.at(rows[149].time).valid


def test_the_clock_goes_by_the_least_delayed_fix():
    clock = live.FixClock()
    assert math.isnan(clock.now(5.0))
    for k, delay in enumerate((0.3, 0.1, 0.9, 0.2)):
        clock.add(1000.0 + k, 50.0 + k + delay)
    assert clock.now(60.0) == pytest.approx(1009.9)
    assert live.FixClock(0.2).latency == 0.2
    for k in range(60):
        clock.add(1100.0 + k, 160.0 + k)  # ten seconds later than before: the old offset counts until its window ends
    assert clock.now(220.0) == pytest.approx(1160.0)


def test_a_table_that_was_cut_off_is_continued(fixes, tmp_path):
    out = tmp_path / "run.csv"
    navigator = live.Navigator("small-usv")
    rows = [row for received in received_from(fixes) for row in navigator.add(received)]
    first, second = live.TableFile(out), live.TableFile(out)
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
        live.TableFile(tmp_path / "nowhere" / "run.csv")

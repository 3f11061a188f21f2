"""Recordings: a replay repeats every bit, also of a file that was cut off; ROS 2 messages read and written."""

import asyncio
import contextlib
import json
import math
import sqlite3
import struct

import numpy as np
import pytest

from steerway.core import InputError, displacement
from steerway.estimation import Profile, estimate
from steerway.formats.testing import nmea0183, read, write
from steerway.live.testing import Feed, Navigator, Order, ReceiverDecoder, RecordedLearning, Service, State, rows_of
from tests.command_line import run
from tests.kept_outputs import Kept, assert_equal, stopped_after
from tests.messages import nav_sat_fix
from tests.scenes import turning
from tests.sentences import START, sortie

pytest.importorskip("mcap", reason="mcap is not installed")
from steerway.formats.testing import mcap, ros2
from steerway.live.testing import ANOTHER_PROCESSOR, ESTIMATE, INPUT, ORDER, RAW, Recorder, Replayed, replay

SETTINGS = {
    "profile": Profile.named("small-usv").toml(),
    "aid": ["sog", "cog"],
    "sources": [],
    "max_dead_reckoning": 10.0,
    "rate": None,
    "accuracy": True,
    "latency": 0.1,
}


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """(path of a recording, rows of the run, its input log)."""
    path, kept = tmp_path_factory.mktemp("recorded") / "run.mcap", Kept()
    recorder = Recorder(path, dict(SETTINGS))
    log, decoder = sortie(120), ReceiverDecoder()
    # Compile first, as `live` does: while a service compiles for seconds, its links deliver epochs in pieces.
    compiling = Service(Navigator("small-usv", ("sog", "cog")), [Kept()], 50.0, 0.1)
    asyncio.run(compiling.replay(decoder.feed(log) + decoder.complete_on_silence()))
    service = Service(Navigator("small-usv", ("sog", "cog")), [kept, recorder], 50.0, 0.1, recorder=recorder)

    async def receives(deliver):
        feed = Feed(ReceiverDecoder(), deliver, lambda data: recorder.raw("tcp://a:1", data))
        for k in range(0, len(log), 83):
            feed.feed(log[k : k + 83])
            await asyncio.sleep(0.0005)
        feed.complete_on_silence()
        service.recorder.tick(kept.fixes[-1], None, Order(State.RUNNING, engaged=True, yaw_rate=0.125))

    asyncio.run(stopped_after(service, receives))
    return path, kept.fixes, log


def test_a_recording_is_repeated_bit_by_bit_holds_every_byte_and_is_a_log_too(recorded):
    path, rows, log = recorded
    found = replay(path)
    assert not found.differing and len(found.recorded) == len(rows) >= 119 and found.orders == 1
    assert np.array(found.repeated).tobytes() == np.array(rows).tobytes()
    motion = estimate(nmea0183.read(log).sources["GP"], "small-usv", aid=("sog", "cog"), causal=True)
    assert_equal(found.repeated, motion.rows(slice(0, len(rows))))
    with open(path, "rb") as file:
        messages = list(mcap.messages(file))
    raw = [message.data for message in messages if message.topic == RAW]
    assert b"".join(data.partition(b"\0")[2] for data in raw) == log
    assert {data.partition(b"\0")[0] for data in raw} == {b"tcp://a:1"}
    assert sum(message.topic == INPUT for message in messages) >= len(rows)
    assert sum(message.topic == ESTIMATE for message in messages) == len(rows)
    (order,) = (json.loads(message.data) for message in messages if message.topic == ORDER)
    assert order["order"]["yaw_rate"] == 0.125 and order["order"]["state"] == "running"
    fixes, direct = read(path), nmea0183.read(log).sources["GP"]
    placed = fixes.rows(fixes.has_position)
    assert fixes.source == "GP" and len(placed) >= 119
    np.testing.assert_array_equal(placed.latitude, direct.latitude[: len(placed)])
    rows = found.recorded
    near = [row._replace(sog=row.sog * (1.0 + 1e-13)) for row in rows]
    found = Replayed(rows, near, 0, 0)  # on another processor the last digits differ
    assert len(found.differing) > 50 and 0.0 < found.largest[0] <= ANOTHER_PROCESSOR
    assert Replayed(rows, near[:-1], 0, 0).largest == (math.inf, "row")


def test_a_run_that_learns_is_repeated_too(tmp_path):
    """A thread infers the profile; the replay changes to it at the same row."""
    path, kept, took = tmp_path / "run.mcap", Kept(), []
    recorder = Recorder(path, SETTINGS | {"profile": None, "learns": True, "aid": []})
    learning = RecordedLearning(background=True)
    learning.note = lambda what, count: (took.append(what), recorder.learning(what, count))
    service = Service(Navigator(learning), [kept, recorder], 50.0, 0.1, recorder=recorder)
    fixes = nmea0183.read(sortie(200)).sources["GP"]

    async def receives(deliver):
        for k, row in enumerate(rows_of({"GP": fixes})):
            deliver([row], 0.2 * k)
            if k % 50 == 0:
                for _ in range(1000):
                    await asyncio.sleep(0.01)
                    if learning._thread is None:
                        break

    asyncio.run(stopped_after(service, receives))
    found = replay(path)
    assert "takes" in took and len(found.recorded) == 200 and not found.differing


def test_the_command_says_whether_the_estimates_are_the_same(recorded, tmp_path):
    """Here they differ: the settings in the recording name another profile."""
    path, rows, log = recorded
    recorder = Recorder(tmp_path / "other.mcap", SETTINGS | {"profile": Profile.named("otter").toml()})
    for row in rows_of({"GP": nmea0183.read(log).sources["GP"]}):
        recorder.input(row, math.nan, "GP")
    for row in rows:
        recorder.fix(row)
    recorder.close()
    code, said, _ = run("replay", tmp_path / "other.mcap")
    assert code == 1 and "estimates differ, the first at 2" in said
    code, said, _ = run("replay", path)
    assert code in (0, None) and said.endswith("every estimate is the same\n")


def test_a_recording_that_was_cut_off_is_repeated_as_far_as_it_goes(recorded, tmp_path):
    whole = recorded[0].read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[: len(whole) * 3 // 5])
    found = replay(cut)
    assert not found.differing
    (tmp_path / "noise.mcap").write_bytes(b"noise")
    with pytest.raises(InputError, match="is not an MCAP file"):
        replay(tmp_path / "noise.mcap")
    with pytest.raises(InputError, match=r"expected \.mcap"):
        Recorder("run.bag", SETTINGS)


def test_a_fix_of_ros_2():
    for frame in ("gps", "gp", "a_longer_frame"):
        time, latitude, longitude, std, *rest = ros2.nav_sat_fix(nav_sat_fix(1700000000.25, 54.0, 190.0, frame=frame))
        assert (time, math.degrees(latitude), std) == (1700000000.25, pytest.approx(54.0), 0.5)
        assert math.degrees(longitude) == pytest.approx(-170.0) and all(map(math.isnan, rest))
    assert math.isnan(ros2.nav_sat_fix(nav_sat_fix(1.0, math.nan, 10.0))[0])


def test_a_bag_of_ros_2(tmp_path):
    path = tmp_path / "bag" / "bag_0.db3"
    path.parent.mkdir()
    with contextlib.closing(sqlite3.connect(path)) as base, base:
        base.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)")
        base.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)")
        base.execute("INSERT INTO topics VALUES (1, '/gps/fix', 'sensor_msgs/msg/NavSatFix', 'cdr')")
        base.execute("INSERT INTO topics VALUES (2, '/imu', 'sensor_msgs/msg/Imu', 'cdr')")
        for k in range(20):
            time, fix = int(1e9 * (START + k)), nav_sat_fix(START + k, 54.0 + 1e-5 * k, 10.0, status=-(k == 7))
            for topic, data in ((1, fix), (2, b"\0" * 40)):
                base.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)", (topic, time, data))
    fixes = read(path)
    assert fixes.source == "/gps/fix" and len(fixes) == 19 and fixes.position_std[0] == 0.5
    np.testing.assert_allclose(np.degrees(fixes.latitude[:3]), [54.0, 54.00001, 54.00002], atol=1e-12)
    (path.parent / "metadata.yaml").touch()  # a ROS 2 bag is a directory
    np.testing.assert_array_equal(read(path.parent).latitude, fixes.latitude)
    with contextlib.closing(sqlite3.connect(tmp_path / "other.db3")) as other, other:
        other.execute("CREATE TABLE a(b)")
    with pytest.raises(InputError, match="not a ROS 2 bag"):
        read(tmp_path / "other.db3")


def test_odometry_has_the_axes_of_ros(tmp_path):
    """x east, y north, yaw = π/2 − χ, ω_z = −χ̇: pose and twist with their covariances are the last 85 doubles."""
    fixes = turning(2.0, 0.5, 60.0).fixes(0.3, 1)
    motion = estimate(fixes, "small-usv", causal=True)
    write(motion, tmp_path / "track.mcap")
    with open(tmp_path / "track.mcap", "rb") as file:
        messages = [each.data for each in mcap.messages(file)]
    stamps = [struct.unpack_from("<iI", data, 4) for data in messages]
    np.testing.assert_allclose([second + 1e-9 * nano for second, nano in stamps], motion.time, atol=1e-6)
    pose, of_pose, twist, _ = np.split(np.array([np.frombuffer(each[-680:]) for each in messages]), [7, 43, 49], axis=1)
    known = np.isfinite(motion.cog)
    turn = 2.0 * np.arctan2(pose[:, 5], pose[:, 6]) - (0.5 * math.pi - motion.cog)
    np.testing.assert_allclose(np.sin(0.5 * turn)[known], 0.0, atol=1e-12)
    np.testing.assert_array_equal(twist[known][:, [0, 5]], np.stack([motion.sog, -motion.course_rate], axis=1)[known])
    np.testing.assert_allclose(of_pose[:, 35], np.where(known, motion.cog_std**2, 1e6))
    north, east = displacement(motion.latitude[-1], motion.longitude[-1], motion.latitude[0], motion.longitude[0])
    np.testing.assert_allclose(pose[-1, :2], (east, north), rtol=0.01, atol=1.0)

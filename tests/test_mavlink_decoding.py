"""Rows decoded from a vehicle's messages: its receiver's fixes, their times, and its own estimate without fixes."""

import math
import time

import numpy as np
import pytest

from steerway.core.testing import displaced
from steerway.live.testing import BootClock, MavlinkDecoder
from tests.mavlink_wire import NOON, Wire, messages


class Heard:
    """A decoder that hears a vehicle."""

    def __init__(self):
        self.decoder, self.wire = MavlinkDecoder(), Wire(1, 1)

    def rows(self, arrival, *output):
        return [row for each in self.wire.carry(output) for row in self.decoder.message(each, arrival)]


def raw_fix(usec, fix_type=3, lat=634400000, lon=104000000, vel=120, cog=27000, h_acc=0):
    return messages.MAVLink_gps_raw_int_message(usec, fix_type, lat, lon, 0, 1, 1, vel, cog, 9, 0, h_acc)


def system_time(unix, boot):
    return messages.MAVLink_system_time_message(round(unix * 1e6), round(boot * 1e3))


def test_a_fix_is_a_row_of_its_own_time_once():
    stamp = system_time(NOON, 50.0)
    first, flat = raw_fix(49_900_000, h_acc=2000), raw_fix(50_100_000, 2, vel=65535, cog=65535)
    row, later = Heard().rows(100.0, stamp, first, raw_fix(49_900_000), flat)
    assert row.source == "mavlink GPS_RAW_INT"
    assert row.time - NOON == pytest.approx(-0.1, abs=1e-6) and later.time - row.time == pytest.approx(0.2, abs=1e-6)
    assert math.degrees(row.latitude) == pytest.approx(63.44) and math.degrees(row.longitude) == pytest.approx(10.4)
    assert row.sog == pytest.approx(1.2) and row.cog == pytest.approx(-math.pi / 2.0)
    assert row.position_std == pytest.approx(math.sqrt(2.0)) and math.isnan(later.position_std)
    assert math.isnan(later.sog) and math.isnan(later.cog)


def test_unix_time_is_believed_and_no_fix_is_none():
    (row,) = Heard().rows(100.0, raw_fix(round(NOON * 1e6)), raw_fix(round(NOON * 1e6) + 1, fix_type=1))
    assert abs(row.time - NOON) < 1e-6
    rows = Heard().rows(100.0, system_time(NOON, 1.0), raw_fix(5, lat=0, lon=0), raw_fix(6, lat=0), raw_fix(7, lon=0))
    assert [math.degrees(row.latitude) for row in rows] == pytest.approx([0.0, 63.44]), "one zero is a place"


def test_her_own_estimate_is_heard_only_when_the_receiver_is_silent():
    def own(boot):
        return messages.MAVLink_global_position_int_message(round(boot * 1e3), 1, 1, 0, 0, -60, 80, 0, 9000)

    heard = Heard()
    rows = heard.rows(0.0, system_time(NOON, 0.0))
    for k in range(100):
        time = 0.2 * k
        rows += heard.rows(time, own(time), *([raw_fix(round(time * 1e6) + 1, fix_type=1)] if time < 10.0 else []))
    placed = [row for row in rows if row.has_position]
    assert placed[0].time - NOON == pytest.approx(12.9, abs=0.11), "a receiver without a fix is not replaced"
    assert all(row.heading == pytest.approx(math.pi / 2.0) for row in rows), "by itself, since there is no fix"
    assert placed[0].cog == pytest.approx(math.atan2(0.8, -0.6)) and placed[0].sog == pytest.approx(1.0)
    heard = Heard()
    heard.rows(0.0, system_time(NOON, 0.0), raw_fix(1))
    own = messages.MAVLink_global_position_int_message(1000, 1, 1, 0, 0, 0, 100, 0, 9000)
    assert not any(row.has_position for row in heard.rows(10.0, *[own] * 5))
    assert [row.has_position for row in heard.rows(10.0, own)] == [True]


def test_compass_and_gyro_come_with_the_fix_and_make_none_late():
    heard, rows = Heard(), []
    for k in range(1, 60):
        now = 0.1 * k
        turned = messages.MAVLink_attitude_message(round(now * 1e3), 0, 0, 0, 0, 0, 0.01 * k)
        own = messages.MAVLink_global_position_int_message(round(now * 1e3), 1, 1, 0, 0, 0, 0, 0, 100 * k)
        output = [system_time(NOON + now, now), turned, own]
        if k % 2 == 0:
            output.append(raw_fix(round((now - 0.12) * 1e6), fix_type=3 if now < 3.0 else 1))
        rows += heard.rows(now, *output)
    fixes = [row for row in rows if row.has_position]
    assert len(fixes) == 14 and [row for row in rows if row.time - NOON < 3.0] == fixes
    assert fixes[3].time - NOON == pytest.approx(0.68, abs=1e-3), "those of its moment"
    assert fixes[3].yaw_rate == pytest.approx(0.07) and fixes[3].heading == pytest.approx(math.radians(7.0))
    assert rows[-1].time - NOON == pytest.approx(5.9, abs=1e-3) and rows[-1].source == "mavlink GLOBAL_POSITION_INT"
    times = [row.time for row in rows]
    assert times == sorted(times)
    assert rows[14].time - NOON == pytest.approx(3.9, abs=1e-3), "a second after the last fix"


@pytest.mark.parametrize("delay", [0.0, 0.35])
def test_a_late_receiver_is_found_by_the_vehicles_own_estimate(delay):
    """On a circle at 2 m/s, with 0.1 m noise of fixes; a row's age is found to be the receiver's delay."""
    heard, random = Heard(), np.random.default_rng(3)

    def place(time):
        return 20.0 * math.sin(0.1 * time), -20.0 * math.cos(0.1 * time)

    def numbers(north, east):
        return [
            round(math.degrees(each) * 1e7) for each in displaced(math.radians(54.0), math.radians(10.0), north, east)
        ]

    ages = []
    for k in range(1, 201):
        now = 0.2 * k
        velocity = round(200.0 * math.cos(0.1 * now)), round(200.0 * math.sin(0.1 * now)), 0
        heading = round(math.degrees(0.1 * now) * 100.0) % 36_000
        own = messages.MAVLink_global_position_int_message(
            round(now * 1e3), *numbers(*place(now)), 0, 0, *velocity, heading
        )
        lat, lon = numbers(*(place(now - delay) + 0.1 * random.standard_normal(2)))
        rows = heard.rows(now, system_time(NOON + now, now), own, raw_fix(round(now * 1e6), lat=lat, lon=lon))
        ages += [heard.decoder.age(row, now) for row in rows]
    missed = math.remainder(rows[-1].heading - 0.1 * (rows[-1].time - NOON), math.tau)
    assert abs(missed) < 0.1 * 0.11, "the heading of the fix's time, of one every 0.2 s"
    assert ages[-1] == pytest.approx(delay, abs=0.03) and ages[45] == pytest.approx(delay, abs=0.05)
    assert heard.decoder.age(rows[-1], now + 1.5) > 1.4 and heard.decoder.age(rows[-1], now + 2.1) == 0.0
    assert max(np.abs(np.diff(ages))) == pytest.approx(0.01, abs=1e-3 if delay else 0.01), "no jump of the time"


def test_boot_clock_waits_then_goes_by_the_computer_and_follows_steps():
    clock = BootClock()
    assert math.isnan(clock.unix(5.0, 100.0)) and math.isnan(clock.unix(7.0, 102.0))
    assert abs(clock.unix(8.5, 103.5) - time.time()) < 0.1
    clock.set(0.0, 9.0)
    clock.set(NOON, 9.0)
    assert clock.unix(10.0, 105.0) - NOON == pytest.approx(1.0, abs=1e-6)
    clock.set(NOON + 1.016, 10.0)
    assert clock.unix(10.0, 105.0) - NOON == pytest.approx(1.001, abs=1e-6)
    clock.set(NOON + 1.401, 10.0)
    assert clock.unix(10.0, 105.0) - NOON == pytest.approx(1.026, abs=1e-6)
    clock.set(NOON + 1.626, 10.0)
    assert clock.unix(10.0, 105.0) - NOON == pytest.approx(1.626, abs=1e-6), "too far off to be corrected slowly"
    clock.set(NOON + 10.0, 2.0)  # the vehicle restarted
    assert clock.unix(2.0, 106.0) - NOON == pytest.approx(10.0, abs=1e-6)
    for boot, arrival in ((9.0, 104.0), (2.0, 106.0)):
        clock.sent(boot, arrival)
    assert clock.now(107.0) - NOON == pytest.approx(11.0, abs=1e-6), "by the message since the restart"


def test_accelerations_and_motors_are_rows_of_their_own_and_the_gyro_waits_for_the_fix():
    stamp, fix = system_time(NOON, 50.0), raw_fix(50_000_000)
    scaled = messages.MAVLink_scaled_imu_message(50_100, 102, 0, 1000, 0, 0, 250, 0, 0, 0)
    raw = messages.MAVLink_raw_imu_message(50_200_000, -102, 0, 1000, 0, 0, 250, 0, 0, 0)
    fine = messages.MAVLink_highres_imu_message(50_300_000, 0.5, 0, 9.8, 0, 0, 0.25, 0, 0, 0, 0, 0, 0, 0, 0)
    heard = Heard()
    rows = heard.rows(100.0, stamp, fix, scaled, raw, fine)
    assert [round(row.acceleration, 3) for row in rows[1:4]] == [1.0, -1.0, 0.5]
    assert all(math.isnan(row.yaw_rate) and not row.has_position for row in rows[1:])
    for rpm, shaft in (((600, 1200, 0, 0), 15.0), ((300, 0, 0, 900), 10.0), ((0, 0, 0, 0), 0.0)):
        none = [0] * 4
        turning = messages.MAVLink_esc_telemetry_1_to_4_message(none, none, none, none, rpm, none)
        (row,) = heard.rows(100.3, turning)
        assert row.shaft == pytest.approx(shaft) and row.time == pytest.approx(NOON + 0.6)
    (after,) = heard.rows(100.4, raw_fix(50_400_000))
    assert after.yaw_rate == pytest.approx(0.25)
    turned = messages.MAVLink_attitude_message
    for boot, usec, known in ((50_500, 51_010_000, False), (51_100, 51_590_000, True), (50_000, 51_595_000, False)):
        heard.rows(100.5, turned(boot, 0, 0, 0, 0, 0, 0.1))
        (row,) = heard.rows(100.5, raw_fix(usec))
        assert math.isfinite(row.yaw_rate) is known, "an aid of another moment, or used before"


@pytest.mark.parametrize(
    ("kind", "autopilot", "armed", "throttle"),
    [
        ("SURFACE_BOAT", "ARDUPILOTMEGA", 0, [0.0]),
        ("SURFACE_BOAT", "ARDUPILOTMEGA", 128, [0.3]),
        ("GROUND_ROVER", "ARDUPILOTMEGA", 129, [0.3]),
        ("SURFACE_BOAT", "PX4", 128, []),
        ("SUBMARINE", "ARDUPILOTMEGA", 128, []),
        ("SUBMARINE", "PX4", 0, [0.0]),
    ],
)
def test_the_throttle_of_a_vehicle_that_tells_it(kind, autopilot, armed, throttle):
    """VFR_HUD has no time of its own, and on other kinds of vehicles its throttle may drive something else."""
    heard = Heard()
    kinds = getattr(messages, f"MAV_TYPE_{kind}"), getattr(messages, f"MAV_AUTOPILOT_{autopilot}")
    beat = messages.MAVLink_heartbeat_message(*kinds, armed, 0, 4, 3)
    hud = messages.MAVLink_vfr_hud_message(0.0, 0.0, 0, 30, 0.0, 0.0)
    heard.rows(0.0, system_time(NOON, 59.0))
    heard.rows(0.1, raw_fix(59_900_000))
    rows = heard.rows(0.4, beat, hud)
    assert [row.throttle for row in rows] == pytest.approx(throttle)
    assert all(row.time - NOON == pytest.approx(1.2, abs=1e-3) and not row.has_position for row in rows)

"""Conditions to take over a vehicle, reasons of a refusal, and signed packets."""

import pytest

from steerway.core import InputError
from steerway.live.testing import Readiness, Settings, State, addresses, key_of
from tests.desk import Desk, square
from tests.mavlink_wire import messages

GOOD_EKF = messages.EKF_ATTITUDE | messages.EKF_VELOCITY_HORIZ | messages.EKF_POS_HORIZ_REL | messages.EKF_POS_HORIZ_ABS
BATTERY = messages.MAV_SYS_STATUS_SENSOR_BATTERY
PREARM = messages.MAV_SYS_STATUS_PREARM_CHECK
PREARM_TEXT = messages.MAVLink_statustext_message(2, b"PreArm: GPS 1: bad")


def heartbeat(armed=True, state=messages.MAV_STATE_ACTIVE):
    flags = messages.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | (messages.MAV_MODE_FLAG_SAFETY_ARMED if armed else 0)
    kinds = messages.MAV_TYPE_SURFACE_BOAT, messages.MAV_AUTOPILOT_ARDUPILOTMEGA
    return messages.MAVLink_heartbeat_message(*kinds, flags, 0, state, 3)


def ekf(flags=GOOD_EKF):
    return messages.MAVLink_ekf_status_report_message(flags, 0.1, 0.1, 0.1, 0.1, 0.0)


def gps(fix=messages.GPS_FIX_TYPE_3D_FIX):
    return messages.MAVLink_gps_raw_int_message(0, fix, 1, 1, 0, 0, 0, 0, 0, 9)


def status(failing=0):
    enabled = BATTERY | PREARM
    return messages.MAVLink_sys_status_message(enabled, enabled, enabled & ~failing, 0, 12000, 0, 50, 0, 0, 0, 0, 0, 0)


def battery(state):
    return messages.MAVLink_battery_status_message(0, 0, 1, 0, [12000] * 10, 0, 0, 0, 50, charge_state=state)


GOOD = (heartbeat(), ekf(), gps(), status())


@pytest.mark.parametrize(
    ("reports", "why"),
    [
        (GOOD, ""),
        ((*GOOD, ekf(GOOD_EKF & ~messages.EKF_POS_HORIZ_ABS)), "EKF is not ready: no position"),
        ((*GOOD, ekf(GOOD_EKF | messages.EKF_CONST_POS_MODE)), "EKF is not ready: no position"),
        ((*GOOD, ekf(messages.EKF_ATTITUDE)), "EKF is not ready: no velocity"),
        ((*GOOD, ekf(messages.EKF_UNINITIALIZED)), "EKF is not ready: it is not initialised"),
        ((*GOOD, ekf(GOOD_EKF | messages.EKF_GPS_GLITCHING)), "positions jump"),
        ((*GOOD, gps(messages.GPS_FIX_TYPE_2D_FIX)), "no 3D fix"),
        ((*GOOD, status(BATTERY)), "fault of its battery"),
        ((*GOOD, battery(messages.MAV_BATTERY_CHARGE_STATE_CRITICAL)), "battery 1 is critically low"),
        ((*GOOD, battery(messages.MAV_BATTERY_CHARGE_STATE_OK)), ""),
        ((*GOOD, heartbeat(state=messages.MAV_STATE_CRITICAL)), "in a fail-safe"),
        ((*GOOD, heartbeat(armed=False)), "the vehicle is not armed"),
        ((*GOOD, heartbeat(armed=False), status(PREARM), PREARM_TEXT), "its pre-arm checks fail: GPS 1: bad"),
        (GOOD[:1], "EKF has not reported"),
    ],
)
def test_a_vehicle_is_ready_when_all_its_parts_are(reports, why):
    readiness = Readiness(messages)
    for each in reports:
        readiness.receive(each, 1.0)
    assert why in readiness.obstacle(1.5) and bool(why) == bool(readiness.obstacle(1.5))


def test_reports_are_not_waited_for_for_ever_old_ones_do_not_hold_and_a_refusal_is_not_tried_again_at_once():
    readiness = Readiness(messages)
    for moment in range(20):
        readiness.receive(heartbeat(), float(moment))
    assert readiness.obstacle(4.9) and not readiness.obstacle(19.5)
    readiness.receive(ekf(0), 20.0)
    assert readiness.obstacle(20.5) and not readiness.obstacle(26.0)
    readiness = Readiness(messages)
    for each in GOOD:
        readiness.receive(each, 1.0)
    readiness.refused("no", 2.0)
    assert readiness.obstacle(3.0) == "no; tried again in 4 s"
    for each in GOOD:
        readiness.receive(each, 7.0)
    assert readiness.obstacle(7.1) == ""


def test_engage_waits_for_the_vehicle_and_again_after_a_refusal_which_stops_a_start_by_hand():
    desk, unready = Desk(square(), engage=True), "the vehicle's EKF is not ready: no position"
    desk.autopilot.vehicle(unready)
    desk.sail(8.0)
    assert desk.order.state is State.IDLE and "EKF" in desk.order.reason
    with pytest.raises(InputError, match="EKF is not ready"):
        desk.autopilot.start()
    desk.autopilot.vehicle("")
    desk.sail(0.1)
    assert desk.order.state is State.RUNNING
    desk.autopilot.vehicle("refused: FAILED; tried again in 5 s")
    desk.autopilot.refused("refused: FAILED")
    desk.sail(1.0)
    assert desk.order.state is State.IDLE and "FAILED" in desk.order.reason and not desk.order.engaged
    desk.autopilot.vehicle("")
    desk.sail(0.1)
    assert desk.order.state is State.RUNNING
    desk.autopilot.stop("by hand")
    desk.sail(5.0)
    assert desk.order.state is State.STOPPED
    withdrawn = Desk(square(), engage=True)
    withdrawn.autopilot.vehicle(unready)
    withdrawn.sail(8.0)
    withdrawn.autopilot.stop()
    withdrawn.autopilot.vehicle("")
    withdrawn.sail(5.0)
    assert withdrawn.order.state is State.READY
    desk = Desk(square()).start()
    desk.autopilot.refused("refused: DENIED")
    desk.sail(1.0)
    assert (desk.order.state, desk.order.reason) == (State.STOPPED, "refused: DENIED")


def test_the_signing_key_is_a_file_and_a_setting(tmp_path):
    (tmp_path / "key").write_text("ab" * 32)
    assert key_of(str(tmp_path / "key")) == bytes.fromhex("ab" * 32)
    (tmp_path / "short").write_text("abc")
    with pytest.raises(InputError, match=r"has 3 characters, expected at least 8"):
        addresses.sources([f"mavlink:udpin:127.0.0.1:14550?signing={tmp_path / 'short'}"])
    with pytest.raises(InputError, match="cannot be read"):
        key_of(str(tmp_path / "none"))
    (tmp_path / "boat.toml").write_text('from = ["mavlink:udpin:127.0.0.1:14550"]\nmavlink_signing = "key"\n')
    settings = Settings.load(tmp_path / "boat.toml")
    (text,) = (addresses.signed(each, settings.mavlink_signing) for each in settings.inputs)
    ((found,), _) = addresses.sources([text])
    assert found.options["signing"] == str(tmp_path / "key")

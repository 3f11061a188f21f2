"""A companion computer and a MAVLink vehicle that exchange packets, without sockets or clocks."""

import math
import random

import pytest

from steerway.core.testing import GroundMotion
from steerway.live.testing import Guided, Order, ReceiverFix, Rover, RoverMode, State, Takeover
from tests.mavlink_wire import NOON, Wire, messages

AT_REST = GroundMotion(*[0.0] * 11)
PLACE = (math.radians(63.44), math.radians(10.4))
RUNNING = Order(State.RUNNING, engaged=True, yaw_rate=0.2, thrust=0.5)
STOPPED = Order(State.STOPPED, "ordered to stop", engaged=True)
HANDED_BACK = Order(State.STOPPED, "ordered to stop", engaged=False)
READY = Order(State.READY)


class Pair:
    """A companion and a vehicle, stepped at 20 Hz."""

    def __init__(self):
        self.rover = Rover(messages, cruise=2.0, unix=NOON)
        self.guided = Guided(messages)
        self.up, self.down = Wire(1, 191), Wire(1, 1)
        self.time = 0.0
        self.order = READY
        self.received = []  # (time, message) of messages that the vehicle received
        self.connected = True
        self.unheard = ()  # types of the vehicle's messages that are lost

    def run(self, seconds):
        for _ in range(round(seconds / 0.05)):
            self.time = round(self.time + 0.05, 6)
            self.step()
        return self

    def step(self):
        self.rover.see(ReceiverFix(self.time, self.time, *PLACE, math.nan, math.nan))
        answers = self.rover.due(self.time, AT_REST, PLACE)
        for message in self.up.carry(self.guided.due(self.time, self.order)):
            if self.connected:
                self.received.append((self.time, message))
                answers += self.rover.receive(message, self.time)
        for message in self.down.carry(answers):
            if self.connected and message.get_type() not in self.unheard:
                self.guided.receive(message, self.time)

    def steered(self, seconds=2.0):
        self.run(2.0).order = RUNNING
        return self.run(seconds)

    def output(self, kind, since=0.0):
        return [each for time, each in self.received if each.get_type() == kind and time > since]


def test_a_vehicle_left_alone_gets_heartbeats_and_an_order_is_carried_out_in_guided_ten_times_a_second():
    pair = Pair().run(10.0)
    beats = pair.output("HEARTBEAT")
    assert 9 <= len(beats) <= 11
    assert {(each.type, each.autopilot) for each in beats} == {(18, 8)}, "as a computer aboard"
    assert pair.rover.mode is RoverMode.MANUAL and not pair.output("SET_ATTITUDE_TARGET")
    assert {each.command for each in pair.output("COMMAND_LONG")} == {messages.MAV_CMD_SET_MESSAGE_INTERVAL}
    pair.order = RUNNING
    begun = pair.time
    pair.run(2.0)
    assert pair.rover.mode is RoverMode.GUIDED and pair.guided.phase is Takeover.STEERING
    targets = pair.output("SET_ATTITUDE_TARGET", begun + 1.0)
    assert 9 <= len(targets) <= 11
    for each in targets:
        assert each.type_mask == 128 | 2 | 1 and each.target_system == 1
        assert each.body_yaw_rate == pytest.approx(0.2) and each.thrust == pytest.approx(0.5)
    for order, target in (
        (RUNNING, (0.2, 1.0)),
        (RUNNING._replace(yaw_rate=math.nan), (0.0, 0.0)),
        (RUNNING._replace(thrust=7.0), (0.2, 2.0)),
        (STOPPED._replace(yaw_rate=0.3, thrust=0.7), (0.0, 0.0)),
    ):
        pair.order = order
        assert pair.run(0.5).rover.target(pair.time)[:2] == pytest.approx(target)


@pytest.mark.parametrize(("order", "mode"), [(STOPPED, RoverMode.HOLD), (HANDED_BACK, RoverMode.MANUAL)])
def test_stopping_gives_her_back(order, mode):
    pair = Pair().steered()
    pair.order = order
    stopped = pair.time
    pair.run(0.3)
    target = pair.rover.target(pair.time)
    if order.engaged:
        assert (target.yaw_rate, target.speed) == (0.0, 0.0) and pair.rover.mode is RoverMode.GUIDED
    else:
        assert target is None and pair.rover.mode is RoverMode.MANUAL
    pair.run(5.0)
    assert pair.rover.mode is mode and pair.guided.phase is Takeover.FREE and pair.rover.target(pair.time) is None
    assert all(each.thrust == 0.0 for each in pair.output("SET_ATTITUDE_TARGET", stopped))
    pair.rover.mode = RoverMode.GUIDED  # by another ground station: then neither steer nor stop it
    quiet = pair.time
    pair.run(5.0)
    assert pair.rover.mode is RoverMode.GUIDED and not pair.output("SET_ATTITUDE_TARGET", quiet)
    pair.order = RUNNING
    assert pair.run(1.0).guided.phase is Takeover.STEERING
    pair.order = order
    pair.step()
    pair.rover.mode = RoverMode.LOITER  # by the skipper while she is being given back: she is his
    assert pair.run(6.0).rover.mode is RoverMode.LOITER and pair.guided.phase is Takeover.FREE


def test_who_takes_her_out_of_guided_has_her():
    pair = Pair().steered()
    pair.rover.mode = RoverMode.MANUAL  # the skipper's remote control
    taken = pair.time
    while not pair.guided.refusal:
        pair.run(0.05)
    assert pair.guided.refusal == "the vehicle was put into MANUAL" and pair.time - taken <= 1.2
    complained = pair.time
    pair.order = STOPPED
    pair.run(10.0)
    assert pair.rover.mode is RoverMode.MANUAL and not pair.guided.refusal
    assert not pair.output("SET_ATTITUDE_TARGET", complained)
    assert all(each.command != messages.MAV_CMD_DO_SET_MODE for each in pair.output("COMMAND_LONG", taken))


def test_a_vehicle_that_is_not_armed_or_does_not_obey_is_a_complaint():
    pair = Pair()
    pair.rover.armed = False
    assert pair.steered(0.2).guided.refusal == "the vehicle is not armed"
    assert pair.rover.mode is RoverMode.MANUAL
    pair = Pair()
    pair.rover = Rover(messages, 2.0, NOON, ekf_time=60.0)
    assert pair.steered(2.5).guided.refusal == ""
    assert pair.run(1.0).guided.refusal == (
        "the vehicle does not go into GUIDED: it failed (FAILED), as before the vehicle has a position"
    )


def test_only_a_rover_is_steered_since_other_vehicles_number_their_modes_otherwise():
    boat, ardupilot = messages.MAV_TYPE_SURFACE_BOAT, messages.MAV_AUTOPILOT_ARDUPILOTMEGA
    for kinds in ((messages.MAV_TYPE_QUADROTOR, ardupilot), (boat, messages.MAV_AUTOPILOT_PX4)):
        guided, wire = Guided(messages), Wire(1, 1)
        for k in range(40):
            (beat,) = wire.carry([messages.MAVLink_heartbeat_message(*kinds, 1 | 128, 0, 4, 3)])
            guided.receive(beat, 0.05 * k)
            output = guided.due(0.05 * k, RUNNING if k > 20 else READY)
            assert all(each.command != messages.MAV_CMD_DO_SET_MODE for each in output if "LONG" in each.get_type())
        assert "not a boat" in guided.refusal
    guided, station = Guided(messages), (messages.MAV_TYPE_GCS, messages.MAV_AUTOPILOT_INVALID)
    assert not guided.receive(*Wire(255, 190).carry([messages.MAVLink_heartbeat_message(*station, 0, 0, 4, 3)]), 0.0)
    assert guided.due(0.0, RUNNING)[0].get_type() == "HEARTBEAT", "a ground station is no vehicle"


def test_a_silent_link_is_lost_and_so_is_one_without_heartbeats():
    """After 2.5 s of silence, before the vehicle drops an order at 3 s; or after five missing heartbeats."""
    pair = Pair().run(3.0)
    assert pair.guided.alive(pair.time)
    pair.connected = False
    assert pair.run(2.4).guided.alive(pair.time)
    assert not pair.run(0.2).guided.alive(pair.time)
    pair.connected = True
    assert pair.run(1.1).guided.alive(pair.time)
    pair.unheard = ("HEARTBEAT",)
    assert pair.run(4.0).guided.alive(pair.time)
    assert not pair.run(1.5).guided.alive(pair.time)


def test_a_request_that_is_carried_out_late_is_taken_back_and_requests_end():
    pair = Pair().run(2.0)
    waiting, receive = [], pair.rover.receive
    pair.rover.receive = lambda message, now: waiting.append(message) or []
    pair.order = RUNNING
    pair.run(0.2)
    pair.order = STOPPED
    pair.run(1.5)
    pair.rover.receive = receive
    for message in waiting:
        receive(message, pair.time)
    assert pair.rover.mode is RoverMode.GUIDED
    assert pair.run(5.0).rover.mode is RoverMode.HOLD
    pair = Pair().steered()
    pair.rover.receive = lambda message, now: []
    pair.order, stopped = STOPPED, pair.time
    pair.run(15.0)
    asked = [each for each in pair.output("COMMAND_LONG", stopped) if each.command == messages.MAV_CMD_DO_SET_MODE]
    assert 14 <= len(asked) <= 17 and pair.guided.phase is Takeover.FREE, "twice a second"
    quiet = pair.time
    assert not pair.run(5.0).output("COMMAND_LONG", quiet) and not pair.output("SET_ATTITUDE_TARGET", quiet)


def test_a_vehicle_obeys_in_guided_and_armed_only():
    def target(thrust=0.5, mask=131):
        return messages.MAVLink_set_attitude_target_message(0, 1, 1, mask, [1, 0, 0, 0], 0, 0, 0.1, thrust)

    def mode(number):
        return messages.MAVLink_set_mode_message(1, 1, number)

    def arm(flag):
        return messages.MAVLink_command_long_message(1, 1, messages.MAV_CMD_COMPONENT_ARM_DISARM, 0, flag, *[0] * 6)

    rover = Rover(messages, 2.0, NOON)
    rover.receive(target(), 0.0)
    (answer,) = rover.receive(mode(RoverMode.GUIDED), 0.0)
    assert answer.result == messages.MAV_RESULT_ACCEPTED and rover.target(0.0) is None, "commanded before GUIDED"
    rover.receive(target(mask=131 | 64), 0.0)
    assert rover.target(0.0) is None, "thrust is to be ignored"
    rover.receive(target(-9.0), 0.0)
    assert rover.target(0.0).speed == -2.0
    (answer,) = rover.receive(arm(0), 0.1)
    assert answer.result == messages.MAV_RESULT_ACCEPTED and rover.target(0.1) is None
    rover.receive(arm(1), 0.2)
    assert rover.target(0.2) is not None
    rover.receive(mode(RoverMode.HOLD), 0.3), rover.receive(mode(RoverMode.GUIDED), 0.4)
    assert rover.target(0.4) is None, "GUIDED begins anew"
    (answer,) = rover.receive(mode(99), 0.5)
    assert answer.result == messages.MAV_RESULT_FAILED and rover.mode is RoverMode.GUIDED
    assert rover.receive(messages.MAVLink_set_mode_message(7, 1, 0), 0.5) == [], "another vehicle is meant"


def test_whatever_happens_she_is_steered_only_by_orders_and_never_against_the_skipper():
    for seed in range(10):
        draw = random.Random(seed)
        pair, by_skipper = Pair().run(1.5), None
        for _ in range(40):
            pair.order = draw.choice([READY, RUNNING, STOPPED, HANDED_BACK, None])
            pair.connected = draw.random() < 0.8
            if draw.random() < 0.2:
                by_skipper = pair.rover.mode = draw.choice([RoverMode.MANUAL, RoverMode.HOLD])
            elif pair.rover.mode is RoverMode.GUIDED:
                by_skipper = None
            begun = pair.time
            pair.run(draw.choice([0.1, 0.5, 2.0]))
            if pair.order is not RUNNING:
                assert all(each.thrust == 0.0 for each in pair.output("SET_ATTITUDE_TARGET", begun))
                asked = [each.param2 for each in pair.output("COMMAND_LONG", begun) if each.command == 176]
                assert RoverMode.GUIDED not in asked
                assert by_skipper is None or pair.rover.mode in (by_skipper, RoverMode.HOLD, RoverMode.MANUAL)

"""The simulated boat as an instrument: her receiver, her inner loops, her propellers, and MAVLink over real links."""

import asyncio
import math
import os
import shutil
import socket
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest

from steerway.core import InputError
from steerway.live import testing as live
from steerway.simulation import load_scenario, parse_scenario
from tests import hastened
from tests.command_line import run
from tests.ports import free_port, running, under_way, until, wait_until

ROOT = Path(__file__).parent.parent
SQUARE = ROOT / "examples" / "otter-square.toml"
RUNNING = live.Order(live.State.RUNNING, engaged=True, yaw_rate=0.2, thrust=0.4)
STOPPED = live.Order(live.State.STOPPED, "ordered to stop", engaged=True)


def boat_of(kind, **keys):
    route = "waypoints = [{ north = 0.0, east = 0.0 }, { north = 900.0, east = 0.0 }]"
    lines = [f'kind = "{kind}"', *(f"{name} = {value}" for name, value in keys.items())]
    return live.SimulatedBoat(parse_scenario("\n".join(["[vessel]", *lines, "[route]", route])))


@pytest.mark.parametrize(
    ("kind", "yaw_rate", "seconds"), [("otter", -0.1, 30.0), ("mariner", -0.004, 1500.0), ("nomoto", 0.05, 200.0)]
)
def test_inner_loops_make_good_what_is_asked(kind, yaw_rate, seconds):
    boat = boat_of(kind, **({"payload_mass": 0.0} if kind == "otter" else {}))
    loops = live.InnerLoops(boat.known)
    for _ in range(round(seconds / boat.step_length)):
        boat.step(loops.step(yaw_rate, 0.6 if kind == "otter" else 1.0, boat.motion, boat.step_length))
    assert boat.motion.yaw_rate == pytest.approx(yaw_rate, rel=0.05)
    if kind == "otter":
        assert boat.motion.sog == pytest.approx(0.6, rel=0.1)
        for _ in range(round(60.0 / boat.step_length)):
            boat.step(loops.rest())
        assert boat.motion.sog < 0.05


def test_what_cannot_be_is_refused_in_a_sentence():
    for arguments, why in (
        (["--live"], "has no output"),
        (["--live", "--seeds", "3", "--to", "stdout:"], "cannot be combined with --live"),
        (["--to", "stdout:"], "expected --live"),
        (["--live", "--to", "stdout:", "--speed", "0"], "speed is 0"),
    ):
        code, _, given = run("simulate", SQUARE, *arguments)
        assert code == 2 and why in given and given.count("\n") == 1


def test_propeller_commands_are_obeyed_until_they_fall_silent():
    actuators = boat_of("otter").vessel.actuators
    propellers = live.PropellerReceiver(live.addresses.datagrams("udp://:1"), actuators)

    async def listen():
        for line in (b"{}", b"garbage", b'{"port": null, "starboard": 1}'):
            propellers.receive(line)
        assert not propellers.obeyed and propellers.command() is None
        propellers.receive(b'{"port": -0.5, "starboard": 0.8}')
        assert propellers.command() == pytest.approx((0.5 * actuators[0].low, 0.8 * actuators[0].high))
        await asyncio.sleep(1.1)
        assert propellers.command() is None

    hastened.run(listen())
    with pytest.raises(InputError, match="expected a vessel of kind otter"):
        live.PropellerReceiver(live.addresses.datagrams("udp://:1"), boat_of("nomoto").vessel.actuators)


class Desk:
    """A vehicle and a companion on a link, in one process; `order` is what the companion gets 50 times a second."""

    def __init__(self, here, there):
        self.running = live.RunningBoat(
            live.SimulatedBoat(load_scenario(SQUARE)), mavlink=live.addresses.vehicle(there)
        )
        ((address,), _) = live.addresses.sources([f"mavlink:{here}"])
        self.companion = live.addresses.opened(address, 1)
        self.supervisor = Mock(hands_back=False)
        output, link = live.addresses.output(
            f"mavlink:{here}", live.Context(inputs=[self.companion], supervisor=self.supervisor)
        )
        assert output is link is self.companion, "one link for both directions"
        self.rows, self.order = [], live.Order(live.State.READY)

    @property
    def links(self):
        """Whether the link was alive, as the autopilot was told."""
        return [each.args[1] for each in self.supervisor.link.call_args_list]

    @property
    def rover(self):
        return self.running.rover

    def receive(self, rows, arrived=None):
        self.rows += rows

    async def tick(self):
        while True:
            self.companion.tick(None, None, self.order)
            await asyncio.sleep(0.02)

    def sail(self, *more):
        return under_way(self.running.run(), self.companion.run(self.receive), self.companion.run(), self.tick(), *more)


def udp():
    port = free_port(socket.SOCK_DGRAM)
    return f"udpin:127.0.0.1:{port}", f"udpout:127.0.0.1:{port}"


async def steered(desk):
    """She is steered and has followed."""
    await until(lambda: len(desk.rows) > 5 and desk.links[-1:] == [True], 30.0)
    desk.order = RUNNING
    await until(lambda: desk.rover.target(desk.running.boat.time) is not None)
    await until(lambda: desk.running.boat.motion.yaw_rate == pytest.approx(0.2, abs=0.03), 10.0)


async def check(desk):
    async with desk.sail():
        await steered(desk)
        assert desk.links == [False, True]
        assert not desk.supervisor.stop.called and not desk.supervisor.refused.called
        desk.order = STOPPED
        begun = desk.running.boat.time
        await until(lambda: desk.rover.target(desk.running.boat.time)[:2] == (0.0, 0.0))
        assert desk.running.boat.time - begun < 0.5
        await until(lambda: desk.rover.mode is live.RoverMode.HOLD)
    sources = {row.source for row in desk.rows if row.has_position}
    assert sources == {"mavlink GPS_RAW_INT"}
    assert any(math.isfinite(row.throttle) for row in desk.rows)
    times = [row.time for row in desk.rows if row.has_position]
    assert np.diff(times) == pytest.approx(0.2, abs=0.02)


def test_steered_over_udp():
    hastened.run(check(Desk(*reversed(udp()))))


@pytest.mark.skipif(shutil.which("socat") is None, reason="socat is not installed")
def test_steered_over_a_serial_line(tmp_path):
    """At true pace."""
    ends = [tmp_path / "boat", tmp_path / "computer"]
    with running("socat", *(f"pty,raw,echo=0,link={each}" for each in ends)):
        wait_until(lambda: all(map(os.path.exists, ends)))
        asyncio.run(check(Desk(*(f"{each}?baud=115200" for each in ends))))


@pytest.mark.parametrize("mode", [live.RoverMode.HOLD, live.RoverMode.MANUAL])
def test_leaving_the_link_gives_her_back(mode):
    async def sail():
        desk = Desk(*udp())
        desk.supervisor.hands_back = mode is live.RoverMode.MANUAL
        async with under_way(desk.running.run()):
            async with under_way(desk.companion.run(desk.receive), desk.tick()):
                await steered(desk)
            await until(lambda: desk.rover.mode is mode)

    hastened.run(sail())

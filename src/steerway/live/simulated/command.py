"""`steerway simulate SCENARIO --live`: the scenario's boat on links, until stopped."""

import contextlib
import sys
from collections.abc import Sequence
from pathlib import Path

from steerway.core.errors import InputError
from steerway.core.files import made_directory
from steerway.live import addresses
from steerway.live.process import log_to_stderr, until_stopped
from steerway.live.simulated.boat import SimulatedBoat
from steerway.live.simulated.running import RunningBoat
from steerway.simulation.scenario import Scenario


def sail_live(
    scenario: Scenario,
    to: Sequence[str] = (),
    mavlink: str | None = None,
    propellers: str | None = None,
    speed: float = 1.0,
    out: str | Path | None = None,
) -> None:
    """Run until SIGINT or SIGTERM. Raises InputError for addresses that cannot be, and without any output."""
    if not to and mavlink is None:
        raise InputError("--live has no output, expected --to ADDRESS or --mavlink ADDRESS")
    if out is not None:
        made_directory(out)
    log_to_stderr("steerway simulate")
    sinks = [addresses.stream(each) for each in to]
    vehicle = None if mavlink is None else addresses.vehicle(mavlink)
    driven = None if propellers is None else addresses.datagrams(propellers)
    cruise = None if vehicle is None or "cruise" not in vehicle.options else vehicle.number("cruise", 0.0)
    running = RunningBoat(SimulatedBoat(scenario), sinks, vehicle, driven, speed, cruise, keeps=out is not None)
    commanded = " and ".join(each for each in (mavlink, propellers) if each)
    until = f" until commanded on {commanded}" if commanded else ""
    print(
        f"{scenario.name}: under way until stopped, by hand in a circle{until}; "
        "the scenario's pilot, route and duration are not used",
        file=sys.stderr,
    )
    try:
        until_stopped(running.run())
    finally:
        for sink in sinks:
            with contextlib.suppress(OSError):
                sink.close()
        if out is not None:
            print(f"wrote {running.write(out)}", file=sys.stderr)

"""A short soak of the running command: every output open, and nothing lost and nothing growing.

Its times are printed by `make soak`: on a shared machine they are the machine's.
"""

import asyncio
import subprocess
import sys

import pytest
from benchmarks.soak.run import soak

from steerway.live.testing import Durations, Pulse

SECONDS = 15.0


WARM = """
from steerway.core.testing import off_path, turn_path, wheel_over
from steerway.__main__ import main
try:
    main()
finally:
    assert all(each.signatures for each in (off_path, turn_path, wheel_over))
"""


def test_a_quarter_of_a_minute_with_every_output_open():
    """What a corner needs is warm too: compiled there, it makes the orders of a boat under way 0.8 s late."""
    subprocess.run([sys.executable, "-c", WARM, "warm"], check=True, capture_output=True)
    done = asyncio.run(soak(SECONDS))
    assert done.code == 0 and "Traceback" not in done.log, done.log
    due = 0.8 * 50.0 * (SECONDS - done.first_row)
    assert done.boat.ticks > due
    assert done.reported > 20 and abs(done.used - done.reported) <= 1, "nothing valid is lost on a damaged line"
    assert done.rows == done.states.height > due
    assert done.growth < 5e6
    received = {each.name: each.received for each in done.consumers}
    assert all(received[name] > 1000 for name in ("tcp-server", "udp", "signalk", "foxglove", "propellers"))


def test_a_histogram_knows_its_quantiles_and_a_pulse_counts_what_comes_late():
    durations = Durations()
    for k in range(1000):
        durations.add(1e-3 if k else 0.5)
    assert durations.within(0.5) == pytest.approx(1e-3, rel=0.1)
    assert durations.within(0.999) == pytest.approx(1e-3, rel=0.1)
    assert durations.within(1.0) == durations.longest == 0.5
    durations.add(1e9), durations.add(0.0)
    assert durations.longest == 1e9
    pulse = Pulse()
    for lateness in (0.0, -0.001, 0.049, 0.051, 3.0):
        pulse.beat(lateness)
    assert (pulse.beats, pulse.missed, pulse.lateness.longest) == (5, 2, 3.0)
    assert "5 ticks" in str(pulse) and "2 later than 50 ms" in str(pulse)

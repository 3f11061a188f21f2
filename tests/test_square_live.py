"""Two processes on a desk, as a user starts them: the square is sailed, and every loss stops the boat."""

import signal
import time

import numpy as np
import pytest

from tests.square import GUIDED, MOST, OTTER, cross_track, desk, rms, truth

pytest.importorskip("pymavlink", reason="pymavlink is not installed")

RUNNING = "autopilot running"
LATE = "the service was late"
ATTEMPTS = 3


def watched(factor, directory, act, by="mavlink", course=OTTER):
    """What `act` finds of boat and computer under way; again, less hurried, where this machine had no time for them."""
    for attempt in range(ATTEMPTS):
        place = directory / str(attempt)
        place.mkdir()
        hurry = max(1.0, factor / 2.0**attempt)
        with desk(place, hurry, by, course) as (boat, computer):
            computer.until(RUNNING)
            found = act(boat, computer, hurry)
        if LATE not in computer.output:
            return found, truth(place), computer.output
    pytest.fail(f"{ATTEMPTS} times {LATE}:\n{computer.output}")


@pytest.mark.parametrize("by", MOST)
def test_the_square_is_sailed_close_to_its_legs_after_the_turns(by, tmp_path):
    """Without a gyro of the vehicle's own, propellers hold a leg half as well."""

    def two_legs(boat, computer, factor):
        begun = time.monotonic()
        while time.monotonic() - begun < 112.0 / factor and "stopped" not in computer.output:
            time.sleep(0.1)

    _, run, output = watched(5.0, tmp_path, two_legs, by)
    assert "stopped" not in output
    legs = cross_track(run)
    assert len(legs[0]) > 100 and rms(legs[0]) <= MOST[by]
    assert np.median(run["true_sog_mps"].to_numpy()[-300:]) == pytest.approx(1.2, abs=0.1)


@pytest.mark.parametrize(("by", "kind"), [("mavlink", "aided"), ("propellers", "interval")])
def test_the_heading_is_that_of_the_filter_in_the_settings(by, kind, tmp_path):
    """A compass that is 6° off, by HDT or as the vehicle's heading, with her gyro."""
    compass = "velocity_std = 0.1\n[compass]\ndeviation_deg = [0.0, 6.0, -6.0, 0.0, 0.0]\n"
    boat, settings = tmp_path / "otter.toml", tmp_path / "live.toml"
    boat.write_text(OTTER.scenario.read_text().replace("markov = []\n", f"markov = []\n{compass}"))
    settings.write_text(f'[estimator.heading]\nkind = "{kind}"\ndeviation_std_deg = 5.0\n')

    def first_leg(_, computer, factor):
        computer.until(rf"heading \({kind}\) known to ± \d+°")
        time.sleep(25.0 / factor)

    course = OTTER._replace(scenario=boat, options=(settings, *OTTER.options))
    _, run, output = watched(5.0, tmp_path, first_leg, by, course)
    assert "stopped" not in output and "unknown" not in output
    assert np.median(run["true_sog_mps"].to_numpy()[-50:]) == pytest.approx(1.2, abs=0.2)


def test_a_vehicle_that_falls_silent_stops_the_autopilot_before_she_drops_the_order(tmp_path):
    def silence(boat, computer, _):
        time.sleep(2.0)
        boat.tell(signal.SIGSTOP)
        cut = time.monotonic()
        noticed = computer.until("stopped: link mavlink:.* is lost") - cut
        boat.tell(signal.SIGCONT)
        time.sleep(5.0)
        return noticed

    noticed, run, _ = watched(1.0, tmp_path, silence)
    assert 2.0 < noticed < 3.0
    assert run["mode"][-1] == 4.0, "when it sends again it is put into HOLD"
    assert run["asked_speed_mps"][-1] is None


def test_a_killed_computer_leaves_a_boat_that_stops_by_herself(tmp_path):
    def kill(boat, computer, factor):
        time.sleep(10.0 / factor)
        computer.tell(signal.SIGKILL)
        time.sleep(20.0 / factor)

    _, run, _ = watched(4.0, tmp_path, kill)
    time_s = run["time_s"].to_numpy()
    driven = run["asked_speed_mps"].is_not_null().to_numpy()
    last = time_s[driven][-1]
    assert run["mode"][-1] == GUIDED and run["true_sog_mps"].to_numpy()[-1] < 0.3, "only the current carries her"
    assert 15.5 < time_s[-1] - last < 18.5, "some 3 s of the 20 since"


def test_an_ended_computer_puts_her_into_hold_at_once(tmp_path):
    def end(boat, computer, _):
        time.sleep(1.0)
        computer.tell(signal.SIGTERM)
        computer.process.wait(20.0)
        time.sleep(1.0)

    _, run, _ = watched(2.0, tmp_path, end)
    assert run["mode"][-1] == 4.0

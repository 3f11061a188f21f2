"""at-sea: what is drawn is balanced, and runs in currents of half the boat's speed are finished close to their legs."""

import math

import pytest

from steerway.core import InputError
from steerway.estimation.steering.testing import ReceiverNoise
from steerway.sensors import Gnss
from steerway_studies.testing import SHIP_LENGTH, Case, Receiver, all_cases, at_sea, drawn, named
from steerway_studies.testing import sailing_judged as judged


def test_full_runs_the_whole_grid(monkeypatch):
    ran = []

    def over_cases(run, pairs, progress=None):
        ran.append([case for case, _ in pairs])
        raise InterruptedError

    monkeypatch.setattr(at_sea, "over_cases", over_cases)
    for full in (False, True):
        with pytest.raises(InterruptedError):
            at_sea.STUDY.run_keeping(None, 1, 3, None, full=full)
    assert ran == [list(drawn(3)), list(all_cases())]
    with pytest.raises(InputError, match="study mariner-los runs all its cases with every seed, expected no --full"):
        named("mariner-los").run_keeping(None, 1, 0, None, full=True)


@pytest.mark.parametrize(
    ("craft", "share", "velocity", "most"),
    [
        ("motorboat", 0.5, True, 0.3),
        ("motorboat", 0.8, True, 1.0),
        ("otter", 0.5, True, 0.5),
        ("otter", 0.25, False, 0.9),
    ],
)
def test_a_square_in_a_current_from_rest_without_a_compass(craft, share, velocity, most):
    found = judged(Case(craft, "square", share, 0.25 * math.pi, Receiver("white", 5.0, velocity)), 1)
    assert found.finished and not found.own_stop
    assert found.legs <= most and found.corners <= 1.5


@pytest.mark.parametrize(("errors", "seed"), [("rtk", 7), ("wandering", 4)])
def test_a_ship_does_not_take_a_current_ahead_for_a_speed_of_its_own(errors, seed):
    found = judged(Case("mariner", "square", 0.8, math.radians(202.5), Receiver(errors, 5.0, errors != "rtk")), seed)
    assert found.finished and found.legs <= 0.5 * SHIP_LENGTH and found.corners <= 1.0


@pytest.mark.parametrize(("white", "markov"), [(0.3, ()), (0.02, ()), (0.05, ((0.25, 5.0),))])
def test_white_and_slow_errors_are_told_apart(white, markov):
    stream, noise = Gnss(rate=5.0, white=white, markov=markov).start(1), ReceiverNoise()
    for k in range(600):
        fix = stream.step(0.2 * k, 0.4 * k, 0.0)
        noise.add(fix.time, fix.north, fix.east)
    assert noise.white == pytest.approx(white, rel=0.35)
    assert noise.slow > 0.1 if markov else noise.slow < white

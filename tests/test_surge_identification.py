"""Drag and thrust from a log, and the verdict on logs that cannot tell."""

import math

import numpy as np
import pytest

from steerway import InputError
from steerway.control import AdaptiveSpeedGains
from steerway.formats.testing import read_surge_log
from steerway.identification import SurgeModel, identify_surge
from steerway.vessels import CALM, Propeller, Surge
from steerway_studies.testing import plants

STEPS = (5.0, 9.0, 14.0, 9.0, 5.0)


def log(commands=STEPS, seconds=40.0, noise=0.01, boat=None, every=0.1, seed=0, speed=0.0):
    """Time, speed and shaft of a boat whose shaft goes from one speed to the next."""
    boat, draws = boat or plants.plant("a"), np.random.default_rng(seed)
    state, rows = boat.start(speed=speed), []
    for k in range(round(len(commands) * seconds / 0.02)):
        state = boat.step(state, (commands[int(k * 0.02 // seconds)],), CALM, 0.02)
        if k % round(every / 0.02) == 0:
            rows.append((0.02 * k + 0.02, state[3] + noise * draws.standard_normal(), state[4]))
    return np.array(rows).T


def test_a_staircase_tells_drag_and_thrust():
    found, truth = identify_surge(*log(), Propeller()), plants.NOMINAL
    assert found.identified and found.verdict.startswith("Identified")
    assert found.model.linear_drag == pytest.approx(truth.linear_drag, rel=0.05)
    assert found.model.quadratic_drag == pytest.approx(truth.quadratic_drag, rel=0.05)
    assert found.model.thrust == pytest.approx(truth.thrust, rel=0.01)
    assert found.residual == pytest.approx(0.01, rel=0.1)


def test_the_deviations_are_those_of_the_estimates():
    truth = np.array([plants.NOMINAL.linear_drag, plants.NOMINAL.quadratic_drag, plants.NOMINAL.thrust])
    boat = log(noise=0.0)
    scores = []
    for seed in range(12):
        noisy = boat[1] + 0.02 * np.random.default_rng(seed).standard_normal(len(boat[1]))
        found = identify_surge(boat[0], noisy, boat[2], Propeller())
        model = found.model
        scores.append((np.array([model.linear_drag, model.quadratic_drag, model.thrust]) - truth) / found.std)
    assert 0.5 < np.sqrt(np.mean(np.square(scores))) < 1.6


def test_another_boat_with_another_propeller_sampled_slowly():
    propeller = Propeller(diameter=0.4, count=1, advance=(0.0, 1.2), coefficient=(0.4, 0.0))
    boat = Surge(800.0, 30.0, 20.0, propeller, plants.shaft(lag=2.0, high=40.0))
    found = identify_surge(*log((10.0, 20.0, 30.0), 60.0, boat=boat, every=1.0), propeller)
    assert found.identified
    assert found.model.linear_drag == pytest.approx(30.0 / 800.0, rel=0.1)
    assert found.model.thrust == pytest.approx(propeller.gain / 800.0, rel=0.03)


SMALL = Surge(60.0, 20.0, 15.0, Propeller(diameter=0.1), plants.shaft(lag=0.2, high=60.0))


@pytest.mark.parametrize("unit", [1.0, 100.0 / 60.0, 400.0 / 60.0])
def test_a_propeller_that_is_not_known_is_identified_in_any_unit_of_command(unit):
    """rev/s, per cent and PWM; the linear curve taken is not P3's, whose slope changes."""
    time, speed, shaft = log((20.0, 35.0, 55.0, 35.0, 20.0), 15.0, boat=SMALL)
    found = identify_surge(time, speed, shaft * unit)
    assert found.identified and "taken to fall evenly" in found.verdict
    assert found.model.quadratic_drag == pytest.approx(0.25, rel=0.05)
    assert found.model.linear_drag == pytest.approx(1.0 / 3.0, rel=0.05)
    assert found.thrust_at_rest * unit**2 == pytest.approx(0.32 * SMALL.propeller.gain / 60.0, rel=0.02)
    guess = AdaptiveSpeedGains(**found.guess(60.0 * unit))
    state = SMALL.start()
    for _ in range(3000):
        state = SMALL.step(state, (60.0,), CALM, 0.02)
    assert guess.top_speed == pytest.approx(state[3], rel=0.2)


def test_a_known_diameter_gives_the_true_physics():
    found = identify_surge(*log((20.0, 35.0, 55.0, 35.0, 20.0), 15.0, boat=SMALL), SMALL.propeller)
    assert found.model.quadratic_drag == pytest.approx(0.25, rel=0.01)
    assert found.model.thrust == pytest.approx(SMALL.propeller.gain / 60.0, rel=0.01) and found.pitch is None


def test_what_is_known_together_is_stated_where_it_is_not_known_apart():
    found = identify_surge(*log())
    assert not found.identified and "only if the propeller's diameter is given" in found.verdict
    assert "8.2" in found.verdict  # m/s at the highest command: what the log does tell


@pytest.mark.parametrize("noise", [0.002, 0.03])
def test_one_speed_does_not_identify(noise):
    found = identify_surge(*log((9.0,), 100.0, noise, speed=5.1))
    assert not found.identified
    assert found.verdict.startswith("Not identified: the speed stays within") and "staircase" in found.verdict


def test_a_log_too_noisy_for_its_steps_does_not_identify():
    found = identify_surge(*log((6.0, 7.5), 8.0, 0.2, speed=2.0))
    assert not found.identified and "Not identified" in found.verdict


def test_the_model_sails_as_the_boat():
    boat, turns = plants.plant("T"), plants.NOMINAL.start(2.0)
    state = boat.start(speed=2.0)
    for k in range(2000):
        state = boat.step(state, (5.0 + 4.0 * math.sin(0.01 * k),), CALM, 0.02)
        turns.step(state[4], 0.02)
    assert turns.speed == pytest.approx(state[3], abs=5e-3)


def test_what_no_controller_can_do_is_said():
    possible, sentence = plants.NOMINAL.feasible(9.0, plants.shaft(rate=17.5 / 55.0))
    assert not possible and "infeasible" in sentence and "49" in sentence
    assert plants.NOMINAL.feasible(9.0, plants.shaft(lag=0.5))[0]
    assert plants.NOMINAL.time_to(12.0, plants.shaft()) == math.inf


def test_the_time_at_full_throttle_is_the_boat_s():
    boat = plants.plant("b")
    state, time = boat.start(), 0.0
    while state[3] < 0.98 * 6.0:
        state, time = boat.step(state, (17.5,), CALM, 0.05), time + 0.05
    assert plants.NOMINAL.time_to(6.0, boat.actuators[0]) == pytest.approx(time, abs=0.06)


def test_unknown_rows_are_left_out():
    time, speed, shaft = log()
    speed[100:150] = np.nan
    assert identify_surge(time, speed, shaft, Propeller()).model.thrust == pytest.approx(
        plants.NOMINAL.thrust, rel=0.02
    )


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ((np.arange(60.0), np.ones(59), np.ones(60)), r"shapes \(60,\), \(59,\), \(60,\)"),
        ((np.arange(9.0), np.ones(9), np.ones(9)), "the log has 9 rows"),
        ((np.r_[0:30.0, 29.0:59.0], np.ones(60), np.ones(60)), "time goes from 29 to 29 s"),
        ((np.arange(60.0), np.ones(60), np.zeros(60)), "the shaft never turns"),
    ],
)
def test_bad_input_is_named(columns, message):
    with pytest.raises(InputError, match=message):
        identify_surge(*columns)


def test_a_log_is_read_from_a_table(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time_s,shaft_rps,speed_mps,note\n0.0,5.0,1.5,a\n0.1, 5.1,,b\n0.2,5.2,x,c\n", encoding="utf-8")
    time, speed, shaft = read_surge_log(path)
    np.testing.assert_array_equal(time, [0.0, 0.1, 0.2])
    np.testing.assert_array_equal(speed, [1.5, np.nan, np.nan])
    np.testing.assert_array_equal(shaft, [5.0, 5.1, 5.2])


def test_a_table_that_is_none_is_refused(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time_s,speed_mps\n0,1\n", encoding="utf-8")
    path.with_name("pwm.csv").write_text("time_s,speed_mps,pwm\n0,1,1500\n", encoding="utf-8")
    with pytest.raises(InputError, match="has no column shaft_rps"):
        read_surge_log(path)
    assert read_surge_log(path.with_name("pwm.csv"), "pwm")[2].tolist() == [1500.0]
    with pytest.raises(InputError, match="has no column rpm"):
        read_surge_log(path.with_name("pwm.csv"), "rpm")
    with pytest.raises(InputError, match="cannot be read"):
        read_surge_log(tmp_path / "none.csv")


def test_a_model_is_a_propeller_with_its_own_thrust():
    model = SurgeModel(0.04, 0.005, 0.03)
    assert model.curve()[0] == 0.03
    np.testing.assert_array_equal(model.curve()[1:], Propeller().curve()[1:])

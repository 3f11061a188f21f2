"""Yaw, heading and surge models from manoeuvres of known boats, and logs that cannot tell."""

import math
import re
import tomllib
from dataclasses import replace

import numpy as np
import polars as pl
import pytest

import steerway
from steerway import InputError
from steerway.control import AdaptiveSpeedGains
from steerway.core import wrap_array
from steerway.identification import (
    SurgeIdentification,
    SurgeModel,
    identify_compass,
    identify_heading,
    identify_surge,
    identify_yaw,
    identify_yaw_from_fixes,
)
from steerway.identification.testing import following
from steerway.sensors import white
from steerway.sensors.testing import CompassTable, deviation
from steerway.vessels import CALM, RPM, Nomoto, Propeller, Springer, Surge, conditions
from steerway_studies.testing import sailing
from tests.command_line import run
from tests.scenes import binary_sequence, sailed

PLANTS = {"otter": (0.5, 1.0, 1.3, -0.03, 0.1, 80.0), "boat": (0.185, 10.0, 2.0, 0.05, 0.2, 240.0)}
TWENTY = math.radians(20.0)


def yaw_manoeuvre(plant, kind="zigzag"):
    """(time, rudder, north, east, heading) of a 20–20 zigzag or a turning circle."""
    gain, time_constant, speed, bias, step, seconds = PLANTS[plant]
    vessel = Nomoto(gain, time_constant, speed, bias)
    state, rows, side = vessel.start(), [], 1.0
    for k in range(round(seconds / step)):
        part = k * step / seconds
        if side * state[2] > TWENTY:
            side = -side
        rudder = (0.0 if part < 0.05 else side * TWENTY) if kind == "zigzag" else (TWENTY if part > 0.15 else 0.0)
        rows.append((k * step, rudder, *state[:3]))
        state = vessel.step(state, (rudder,), CALM, step)
    return np.array(rows).T


def compass(heading):
    """What a compass of 1° says, wrapped."""
    return wrap_array(heading + math.radians(1.0) * np.random.default_rng(1).standard_normal(len(heading)))


def assert_known(model, plant):
    gain, time_constant, _, bias, _, _ = PLANTS[plant]
    assert model.gain.value == pytest.approx(gain, rel=0.05)
    assert model.time_constant.value == pytest.approx(time_constant, rel=0.05)
    assert model.rudder_bias.value == pytest.approx(bias, abs=0.05 * TWENTY)


@pytest.mark.parametrize(("plant", "kind"), [("otter", "zigzag"), ("boat", "circle")])
def test_a_known_plant_comes_back_from_a_compass(plant, kind):
    time, rudder, _, _, heading = yaw_manoeuvre(plant, kind)
    angle = compass(heading)
    angle[::2] = np.nan  # rows without an angle are passed over
    model = identify_yaw(time, rudder, angle)
    assert_known(model, plant)
    gain, time_constant = PLANTS[plant][:2]
    assert gain in model.gain and time_constant in model.time_constant and model.gain.high < 1.3 * model.gain.low
    assert model.samples == len(time) // 2


def test_a_known_plant_comes_back_from_positions():
    time, rudder, north, east, _ = yaw_manoeuvre("otter")
    north[len(north) // 2] += 80.0  # an outlier costs nothing
    fixes = white(0.1).fixes(time, north, east, seed=3, origin=(0.6, 3.1))
    assert_known(identify_yaw_from_fixes(fixes, time, rudder), "otter")


def test_a_moment_is_a_rudder_of_another_unit():
    """K times the unit is what is known, however large the numbers of the rudder are."""
    time, rudder, _, _, heading = yaw_manoeuvre("boat")
    in_radians = identify_yaw(time, rudder, compass(heading))
    in_newton_metres = identify_yaw(time, 1e4 * rudder, compass(heading))
    assert in_newton_metres.gain.value == pytest.approx(1e-4 * in_radians.gain.value, rel=1e-6)
    assert in_newton_metres.gain.high == pytest.approx(1e-4 * in_radians.gain.high, rel=1e-3)
    assert in_newton_metres.rudder_bias.value == pytest.approx(1e4 * in_radians.rudder_bias.value, rel=1e-6)


@pytest.mark.parametrize(
    ("identify", "message"),
    [
        (lambda t, r, a: identify_yaw(t, r[:-1], a), "rudder has shape"),
        (lambda t, r, a: identify_yaw(t, np.full_like(r, 0.1), a), "the rudder stays at 0.1"),
        (lambda t, r, a: identify_yaw(t, r, np.full_like(a, np.nan)), "0 angles were measured"),
        (lambda t, r, a: identify_yaw(t, r, 0.01 * np.sin(t)), "the vessel turned by 1.1°"),
        (lambda t, r, a: identify_heading(t + 5.0 * (t > 50.0), r, a), "identify heading"),
        (lambda t, r, a: identify_surge(t[:9], a[:9], a[:9]), "the log has 9 rows"),
        (lambda t, r, a: identify_surge(np.minimum(t, 29.0), a, a), "time goes from 29 to 29 s"),
        (lambda t, r, a: identify_surge(t, a, 0.0 * a), "the shaft never turns"),
    ],
)
def test_a_record_that_cannot_tell_is_refused(identify, message):
    time, rudder, _, _, heading = yaw_manoeuvre("boat")
    with pytest.raises(InputError, match=message):
        identify(time, rudder, heading)


def table_of(tmp_path, **columns):
    path = tmp_path / "log.csv"
    pl.DataFrame(columns).write_csv(path)
    return path


def test_yaw_by_the_command_gives_back_a_known_ship_and_its_gains(tmp_path):
    time, rudder, _, _, heading = yaw_manoeuvre("boat")
    angle = np.round(np.degrees(heading), 1) % 360.0
    log = table_of(tmp_path, time_s=time, rudder_deg=np.degrees(rudder), heading_deg=angle)
    code, out, err = run("identify", "yaw", log, "--bandwidth", "0.5")
    assert (code, err) == (0, "") and "K_p" in out and "T_i" in out
    found = re.findall(r"^(?:gain|time).*?  +([\d.]+) ", out, re.MULTILINE)
    assert [float(each) for each in found] == pytest.approx(PLANTS["boat"][:2], rel=0.05)
    code, _, err = run("identify", "yaw", log, "--rudder", "helm")
    assert code == 2 and "no column 'helm'" in err
    code, _, err = run("identify", "yaw", table_of(tmp_path, time_s=[1.0, 2.0], rudder_deg=[1.0, 2.0]))
    assert code == 2 and "neither heading, course nor positions" in err


def heading_manoeuvre(step):
    """(time, n_d in rpm, heading) of a binary sequence of Springer's, without noise; propellers that follow at once."""
    rng, n = np.random.default_rng(0), round(900 / step)
    steering = binary_sequence(n, round(20 / step), 100.0, rng)
    vessel = Springer("physical", bias=5.0 * RPM)
    state, heading = vessel.start(heading=1.0), np.empty(n)
    for k in range(n):
        heading[k] = vessel.heading(state)
        state[4] = steering[k] * RPM
        state = vessel.step(state, (steering[k] * RPM,), conditions(), step)
    return step * np.arange(n), steering, heading


def test_a_heading_model_is_exact_from_a_clean_record_and_its_rates_are_per_second():
    time, steering, heading = heading_manoeuvre(1.0)
    model = identify_heading(time, steering, heading)
    truth = Springer("physical").yaw
    assert model.poles == pytest.approx((1.0, 0.9945), abs=1e-6)
    np.testing.assert_allclose(model.gains, np.multiply(truth.inputs, truth.outputs), rtol=1e-4)
    assert model.bias == pytest.approx(5.0, abs=1e-3)
    assert model.fit > 99.99 and model.heading0 == pytest.approx(1.0, abs=1e-4)
    np.testing.assert_allclose(model.run(steering), heading, atol=1e-4)
    half = identify_heading(*heading_manoeuvre(0.5))
    assert half.turn_rate == pytest.approx(model.turn_rate, rel=1e-3)
    assert half.time_constant == pytest.approx(model.time_constant, rel=1e-3)


STEPS = (5.0, 9.0, 14.0, 9.0, 5.0)


def log(commands=STEPS, seconds=40.0, noise=0.01, boat=None, speed=0.0):
    """Time, speed and shaft of a boat whose shaft goes from one speed to the next."""
    boat, draws = boat or sailing.plant("a"), np.random.default_rng(0)
    state, rows = boat.start(speed=speed), []
    for k in range(round(len(commands) * seconds / 0.02)):
        state = boat.step(state, (commands[int(k * 0.02 // seconds)],), CALM, 0.02)
        if k % 5 == 0:
            rows.append((0.02 * k + 0.02, state[3] + noise * draws.standard_normal(), state[4]))
    return np.array(rows).T


def test_a_staircase_tells_drag_and_thrust_also_by_the_command(tmp_path):
    time, speed, shaft = log()
    found, truth = identify_surge(time, speed, shaft, Propeller()), sailing.NOMINAL
    assert found.identified and found.verdict.startswith("Identified")
    assert found.model.linear_drag == pytest.approx(truth.linear_drag, rel=0.05)
    assert found.model.quadratic_drag == pytest.approx(truth.quadratic_drag, rel=0.05)
    assert found.model.thrust == pytest.approx(truth.thrust, rel=0.01)
    assert found.residual == pytest.approx(0.01, rel=0.1)
    guess, steady = found.guess(18.0), speed[(time > 60.0) & (time < 80.0)].mean()  # at 9 rev/s, half of that
    drag = guess["linear_drag"] * steady + guess["quadratic_drag"] * steady**2
    assert guess["thrust"] * 9.0**2 == pytest.approx(drag, rel=0.01)
    table = table_of(tmp_path, time_s=time, speed_mps=speed, shaft_rps=shaft)
    code, out, _ = run("identify", "surge", table, "--diameter", "0.8")
    assert code == 0 and found.verdict in out
    assert float(out.splitlines()[3].split()[2]) == pytest.approx(found.model.thrust, rel=1e-3)
    code, out, _ = run("identify", "surge", table, "--shaft", "shaft_rps")
    assert code == 0 and "at one unit of shaft_rps" in out


SMALL = Surge(60.0, 20.0, 15.0, Propeller(diameter=0.1), sailing.shaft(lag=0.2, high=60.0))


def test_a_propeller_that_is_not_known_is_identified_in_any_unit_of_command():
    """Per cent; the linear curve taken is not P3's, whose slope changes."""
    unit = 100.0 / 60.0
    time, speed, shaft = log((20.0, 35.0, 55.0, 35.0, 20.0), 15.0, boat=SMALL)
    found = identify_surge(time, speed, shaft * unit)
    assert found.identified and "assumed to fall linearly" in found.verdict
    assert found.model.quadratic_drag == pytest.approx(0.25, rel=0.05)
    assert found.model.linear_drag == pytest.approx(1.0 / 3.0, rel=0.05)
    assert found.thrust_at_rest * unit**2 == pytest.approx(0.32 * SMALL.propeller.gain / 60.0, rel=0.02)
    guess = AdaptiveSpeedGains(**found.guess(60.0 * unit))
    state = SMALL.start()
    for _ in range(3000):
        state = SMALL.step(state, (60.0,), CALM, 0.02)
    assert guess.top_speed == pytest.approx(state[3], rel=0.2)


@pytest.mark.parametrize("lag", [0.3, 1.0])
def test_the_lag_of_a_shaft_that_is_only_commanded_is_found(lag):
    boat = sailing.shaft(lag=lag)
    time, speed, turning = log(boat=Surge(shaft=boat))
    commands = np.array(STEPS)[np.minimum((time - 0.02) // 40.0, 4).astype(int)]
    found, measured = (identify_surge(time, speed, each, Propeller()) for each in (commands, turning))
    assert found.lag == pytest.approx(lag, abs=0.08) and 0.0 < found.lag_std < 0.1 * lag
    assert found.model.thrust == pytest.approx(sailing.NOMINAL.thrust, rel=0.05)  # what identified means
    assert found.guess(17.5)["shaft_lag"] == found.lag
    assert measured.lag < 0.05  # the shaft itself, at the end of each row's step


def test_a_shaft_follows_a_ramp_and_a_guess_balances_drag_half_way():
    time, command, lag, expected = np.array([0.0, 0.5, 2.0, 2.1]), np.array([1.0, 4.0, 2.0, 2.0]), 0.7, [1.0]
    for dt, begin, end in zip(np.diff(time), command, command[1:], strict=False):
        behind = lag * (end - begin) / dt
        expected.append(end - behind + (expected[-1] - begin + behind) * math.exp(-dt / lag))
    np.testing.assert_allclose(following(time, command, lag), expected, rtol=1e-9)
    guess = SurgeIdentification(SurgeModel(0.02, 0.05, 0.01), np.zeros(3), 0.0, True, "").guess(10.0)
    assert guess["linear_drag"] == 0.02 and 0.0 < guess["thrust"] < 0.01


def test_what_a_log_does_not_tell_is_said(tmp_path):
    """Known together but not apart without a propeller; one speed; 8.2 m/s at the highest command is what it tells."""
    found = identify_surge(*log())
    assert not found.identified and "Give the propeller's diameter" in found.verdict and "8.2" in found.verdict
    time, speed, shaft = log((9.0,), 100.0, 0.03, speed=5.1)
    assert not identify_surge(time, speed, shaft).identified
    table = table_of(tmp_path, time_s=time, speed_mps=speed, shaft_rps=shaft)
    code, out, _ = run("identify", "surge", table, "--diameter", "0.8")
    assert code == 0 and re.search("Not identified: the speed stays between 4.79 and 5.05 m/s.*staircase", out)


def test_what_no_controller_can_do_is_said():
    possible, sentence = sailing.NOMINAL.feasible(9.0, sailing.shaft(rate=17.5 / 55.0))
    assert not possible and "infeasible" in sentence and "49" in sentence
    assert sailing.NOMINAL.feasible(9.0, sailing.shaft(lag=0.5))[0]
    assert sailing.NOMINAL.time_to(12.0, sailing.shaft()) == math.inf


CARD = np.radians([2.0, 5.0, -3.0, 1.0, 0.5])


def circles(seed, turns=2.0):
    """Fixes at 5 Hz and a compass of 1°, in circles to both sides at 1.5 m/s in a current of 0.25 m/s."""
    time = np.arange(0.0, 480.0, 0.2)
    heading = np.cumsum(np.where(time % 240.0 < 120.0, 0.2, -0.2) * turns * math.pi / 120.0)
    north, east = 1.5 * np.cos(heading) + 0.2, 1.5 * np.sin(heading) - 0.15
    fixes = sailed(np.hypot(north, east), np.unwrap(np.arctan2(east, north))).fixes(0.3, seed)
    bow = np.interp(time - 0.4, time, heading)
    read = bow + deviation(bow, *CARD) + math.radians(1.0) * np.random.default_rng([seed, 1]).standard_normal(len(time))
    return replace(fixes, heading=np.mod(read, 2.0 * math.pi))


@pytest.mark.parametrize("seed", [31, 32])
def test_a_compass_is_found_from_circles_in_a_current(seed):
    fixes = circles(seed)
    found = identify_compass(fixes, steerway.estimate(fixes, "small-usv"))
    around = np.linspace(0.0, 2.0 * math.pi, 73)
    off = deviation(around, *(each.value for each in found.card)) - deviation(around, *CARD)
    assert np.abs(off).max() < math.radians(0.6)
    assert sum(true in each for true, each in zip(CARD.tolist(), found.card, strict=True)) >= 4
    assert found.lag.value == pytest.approx(0.4, abs=0.1) and found.noise == pytest.approx(math.radians(1.0), rel=0.1)
    assert found.speed == pytest.approx(1.5, abs=0.02) and found.current == pytest.approx((0.2, -0.15), abs=0.01)


def test_half_a_circle_tells_no_card():
    fixes = circles(31, turns=0.4)
    with pytest.raises(InputError, match="of 8 sectors of the circle"):
        identify_compass(fixes, steerway.estimate(fixes, "small-usv"))
    with pytest.raises(InputError, match="the log has 0 headings"):
        identify_compass(replace(fixes, heading=None), steerway.estimate(fixes, "small-usv"))


def test_identify_compass_prints_the_table_of_a_scenario(tmp_path):
    fixes = circles(33).rows(slice(None, None, 5))
    columns = {"time_s": fixes.time, "lat_deg": np.degrees(fixes.latitude), "lon_deg": np.degrees(fixes.longitude)}
    pl.DataFrame(columns | {"heading_deg": np.degrees(fixes.heading)}).write_csv(tmp_path / "circles.csv")
    code, told, _ = run("identify", "compass", tmp_path / "circles.csv")
    table = tomllib.loads(told[told.index("[compass]") :])["compass"]
    assert code == 0 and CompassTable(**table).deviation_deg == pytest.approx(np.degrees(CARD), abs=0.7)

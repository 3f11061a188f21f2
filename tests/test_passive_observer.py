"""The passive observer against golden rows, and what it says of gains before it runs."""

import math
import warnings

import numpy as np
import pytest

from steerway import InputError
from steerway.core import wrap
from steerway.estimation.positioning import DEMO_GAINS, ObserverGains, PassiveObserver
from steerway.vessels import CALM, CyberShip2
from steerway.vessels.testing import DAMPING, INERTIA
from steerway_studies.testing import TUNED_GAINS, scenario
from tests.cybership_forces import public_forces
from tests.golden import assert_golden, columns, golden


def demo(correction="held", **more):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return PassiveObserver(INERTIA, DAMPING, DEMO_GAINS, correction, **more)


def test_the_observer_goes_the_golden_way(shared_data):
    table, h = golden(shared_data, "cs2_passive_observer"), 0.02
    waves = lambda t: np.array([0.3, 0.2, 0.02]) * np.sin(0.8 * t + np.array([0.0, 1.0, 2.0]))  # noqa: E731
    truth, measured = columns(table, "x", "y", "psi"), columns(table, "y1", "y2", "y3")
    vessel, state = CyberShip2(), np.zeros(6)
    observer = demo(fix_interval=h, heading_interval=h)
    rows = [observer.state.copy()]
    for k in range(5 * (len(table) - 1)):
        # White noise is held over a tenth of a second; vessel and waves move on.
        noise = measured[k // 5] - truth[k // 5] - waves(table["t"][k // 5])
        seen = state[:3] + waves(h * k) + noise
        observer.update(*seen[:2])
        observer.update_heading(seen[2])
        observer.predict(public_forces(h * k), h)
        state = vessel.step(state, public_forces(h * k), CALM, h)
        if k % 5 == 4:
            rows.append(observer.state.copy())
    rows, expected = np.array(rows), columns(
        table, *"xi1 xi2 xi3 ew1 ew2 ew3 xh yh psih b1 b2 b3 uh vh rh".split()
    )  # fmt: skip
    expected[:, 8] = [wrap(each) for each in expected[:, 8]]
    assert_golden(rows, expected)


def test_gains_out_of_order_are_warned_of():
    with pytest.warns(UserWarning, match="K3/K4 = 1 1/s, expected below 0.8"):
        PassiveObserver(INERTIA, DAMPING, DEMO_GAINS, "held")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        PassiveObserver(INERTIA, DAMPING, TUNED_GAINS)
    slow = ObserverGains((1.0,) * 3, (0.1,) * 3, (10.0,) * 3, 100.0)
    assert "well above 1/T_b" in slow.out_of_order()
    narrow = ObserverGains((0.5,) * 3, (1.0,) * 3, (10.0,) * 3, 100.0, 0.8)
    assert "ω_c = 0.5 1/s, expected above ω₀ = 0.8" in narrow.out_of_order()


def test_divergence_is_detected_before_it_runs():
    with pytest.raises(InputError, match=r"diverge with held innovation corrections every 1 s.*1\.74"):
        demo("held innovation")
    assert demo("held innovation", check=False).spectral_radius == pytest.approx(1.74, abs=0.01)
    assert demo("held").spectral_radius < 1.0


def test_what_is_said_to_diverge_does_and_what_is_not_does_not():
    for correction, grows in (("held innovation", True), ("held", False)):
        observer = demo(correction, check=False)
        observer.start(1.0, -1.0, 0.0)
        for k in range(400):
            if k % 10 == 0:
                observer.update(0.0, 0.0)
            observer.update_heading(0.0)
            observer.predict((0.0, 0.0, 0.0), 0.1)
        assert (math.hypot(*observer.motion[:2]) > 1e3) == grows


@pytest.mark.parametrize("correction", ["held", "impulsive"])
def test_with_dense_fixes_all_forms_are_the_continuous_observer(correction):
    h = 0.01
    ends = []
    for form in ("held innovation", correction):
        observer = PassiveObserver(INERTIA, DAMPING, TUNED_GAINS, form, fix_interval=h, heading_interval=h)
        for k in range(1000):
            observer.update(math.sin(0.01 * k), 0.002 * k)
            observer.update_heading(0.001 * k)
            observer.predict((0.5, 0.2, 0.02), h)
        ends.append(observer.state)
    np.testing.assert_allclose(*ends, atol=0.02)


def test_it_finds_a_constant_force():
    observer = PassiveObserver(INERTIA, DAMPING, ObserverGains((0.5,) * 3, (0.3,) * 3, (3.0,) * 3, 1e9))
    sea, heading = np.array([0.2, -0.1, 0.01]), 0.6
    c, s = math.cos(heading), math.sin(heading)
    body = (c * sea[0] + s * sea[1], c * sea[1] - s * sea[0], sea[2])
    for k in range(6000):  # she lies still: her actuators answer the sea
        if k % 10 == 0:
            observer.update(1.0, 2.0)
        observer.update_heading(heading)
        observer.predict([-each for each in body], 0.1)
    np.testing.assert_allclose(observer.motion.force, sea, atol=1e-4)
    np.testing.assert_allclose(observer.motion.velocity, 0.0, atol=1e-5)


def test_on_the_scenario_tuning_and_impulses_make_it_good():
    records = [scenario.sail(scenario.drawn(seed)) for seed in range(6)]
    tuned = PassiveObserver(INERTIA, DAMPING, TUNED_GAINS)
    errors = [scenario.watch(tuned, record).mae for record in records]
    stock = [scenario.watch(demo("held"), record).mae for record in records]
    assert np.mean(errors) < 0.056 < 0.09 < np.mean(stock)


def test_without_a_compass_it_turns_by_its_own_heading():
    observer = PassiveObserver(INERTIA, DAMPING, TUNED_GAINS, heading_interval=None)
    vessel, state, force = CyberShip2(), CyberShip2().start(heading=1.0), (1.0, 0.2, 0.05)
    observer.start(0.0, 0.0, 1.0)
    for k in range(300):
        if k % 10 == 0:
            observer.update(*state[:2])
        observer.predict(force, 0.1)
        state = vessel.step(state, force, CALM, 0.1)
    motion = observer.motion
    assert math.hypot(motion.north - state[0], motion.east - state[1]) < 0.1 < math.hypot(*state[:2])
    assert abs(wrap(motion.heading - state[2])) < 0.1 < abs(wrap(state[2] - 1.0))


def test_bad_input_is_named():
    with pytest.raises(InputError, match=r"observer\.correction is 'sudden'"):
        PassiveObserver(INERTIA, DAMPING, TUNED_GAINS, "sudden")
    with pytest.raises(InputError, match=r"observer\.force is"):
        ObserverGains((1.0,) * 3, (-1.0, 1.0, 1.0), (1.0,) * 3)
    with pytest.raises(InputError, match=r"observer\.fix_interval"):
        PassiveObserver(INERTIA, DAMPING, TUNED_GAINS, fix_interval=0.0)


def test_an_interval_of_zero_is_not_taken_for_no_compass():
    with pytest.raises(InputError, match=r"observer\.heading_interval is 0"):
        PassiveObserver(INERTIA, DAMPING, TUNED_GAINS, heading_interval=0.0)

"""Standard manoeuvres: zigzag, turning circle and pull-out, with the numbers of IMO's resolution MSC.137(76).

The pilot sets the helm directly, with true states and the thrust that holds the cruise speed: "zigzag:10/10" (helm, and
change of heading at which it is reversed, degrees), "turning-circle:35" and "pull-out:20" (helm). The helm is a rudder
angle; for a boat without a rudder it is a percentage of the autopilot's largest output.
"""

import math
import re
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from steerway.control.boats import Boat
from steerway.core.angles import wrap
from steerway.core.errors import InputError
from steerway.core.estimate import Measurements
from steerway.core.reference import Reference
from steerway.estimation.aboard import AtFaceValue
from steerway.guidance.ordered import Order, Ordered
from steerway.pilot import Mode, Orders
from steerway.simulation.loop import Run

APPROACH = 60.0
"""Time (s) on a straight course in which a boat with a speed loop reaches its cruise speed."""
EXECUTES = 4
"""Number of helm orders (executes) of a zigzag: four give two overshoots to either side."""
CIRCLES = 1.5
"""Turns of a turning circle; the last half turn is steady."""
_FORM = re.compile(r"(?:(zigzag):([\d.]+)/([\d.]+)|(turning-circle|pull-out):(-?[\d.]+))")
EXPECTED = 'expected "zigzag:10/10", "turning-circle:35" or "pull-out:20"'


class Manoeuvre(NamedTuple):
    """A manoeuvre: `kind`, `helm` in degrees or percent, and for a zigzag the `change` of heading, degrees."""

    kind: str
    helm: float
    change: float = math.nan


def manoeuvre_of(text: str) -> Manoeuvre:
    """Parse a manoeuvre. Raises InputError for an invalid one."""
    found = _FORM.fullmatch(text)
    try:
        parts: tuple[Any, ...] = found.groups() if found else (None,) * 5
        zigzag, helm, change, other, alone = parts
        made = Manoeuvre(zigzag, float(helm), float(change)) if zigzag else Manoeuvre(other, float(alone))
    except (TypeError, ValueError):
        raise InputError(f"manoeuvre is {text!r}, {EXPECTED}") from None
    if not 0.0 < abs(made.helm) <= 100.0 or not (math.isnan(made.change) or 0.0 < made.change <= 90.0):
        raise InputError(f"manoeuvre is {text!r}, expected a helm of up to 100 and a change of heading of up to 90")
    return made


class ManoeuvringPilot:
    """A pilot that performs a manoeuvre; the loop uses it as a `pilot.Pilot`."""

    def __init__(self, manoeuvre: Manoeuvre, boat: Boat, has_rudder: bool, heading: float):
        self.manoeuvre = manoeuvre
        self.mission = Ordered([Order(0.0, heading)], boat.cruise)
        self.finished = False
        scale = math.radians(1.0) if has_rudder else 0.01 * boat.yaw_limit
        self._helm = math.copysign(min(abs(manoeuvre.helm) * scale, boat.yaw_limit), manoeuvre.helm)
        self._actuation, self._speed = boat.propulsion, boat.speed_loop()
        self._estimator = AtFaceValue()
        self._approach = APPROACH if self._speed else 0.0
        self._force, self._time = 0.0, 0.0
        self._heading, self.turned = heading, 0.0  # rad, unwrapped
        kinds: dict[str, Callable[[float], float]] = {
            "zigzag": self._zigzag,
            "turning-circle": self._circle,
            "pull-out": self._pull_out,
        }
        self._steer = kinds[manoeuvre.kind]
        self._side, self._executes, self._from = 1.0, 0, 0.0
        self._lasted = self._left = 0.0  # duration of the turn of a pull-out, and time left midships, s

    def step(self, measurements: Measurements, dt: float) -> Orders:
        """The commands, dt s after the previous step."""
        estimate = self._estimator.step(measurements, dt)
        leg = self.mission.step(estimate.north, estimate.east, dt)
        self.turned += wrap(estimate.heading - self._heading)
        self._heading = estimate.heading
        yaw = 0.0
        if self._time >= self._approach - 1e-9:
            yaw = self._steer(dt)
        elif self._speed is not None:
            self._force = self._speed.step(leg.speed, estimate.sog, dt)
            self._from = self.turned
        *command, achieved, yaw_achieved = self._actuation.step(self._force, yaw)
        if self._speed is not None:
            self._speed.limited_to(achieved)
        self._time += dt
        nothing = Reference(math.nan, 0.0, 0.0)
        mode = Mode.STOPPED if self.finished else Mode.UNDER_WAY
        return Orders(tuple(command), estimate, leg, nothing, nothing, math.nan, self._force, yaw_achieved, mode, False)

    def _zigzag(self, dt: float) -> float:
        change = self._side * (self.turned - self._from)
        if change >= math.radians(self.manoeuvre.change):
            self._side, self._executes = -self._side, self._executes + 1
            self.finished = self._executes > EXECUTES
        return self._side * self._helm

    def _circle(self, dt: float) -> float:
        self.finished = abs(self.turned - self._from) >= CIRCLES * 2.0 * math.pi
        return self._helm

    def _pull_out(self, dt: float) -> float:
        """A full turn to one side, midships for the same time, then the same to the other side."""
        turns = self._executes % 2 == 0
        self._lasted += dt
        if turns and abs(self.turned - self._from) < 2.0 * math.pi:
            return self._side * self._helm
        if turns:
            self._executes, self._left = self._executes + 1, self._lasted
        self._left -= dt
        if self._left <= 0.0:
            self._executes, self._side, self._from, self._lasted = self._executes + 1, -1.0, self.turned, 0.0
            self.finished = self._executes == 4
        return 0.0


def measured(run: Run, pilot: ManoeuvringPilot, length: float) -> dict[str, float]:
    """Results of a manoeuvre; distances also in ship lengths, if the length (m) is not NaN."""
    start = int(np.argmax(run["yaw"] != 0.0))
    numbers = {"zigzag": _of_zigzag, "turning-circle": _of_circle, "pull-out": _of_pull_out}[pilot.manoeuvre.kind](
        run.rows(slice(start, None)), pilot.manoeuvre
    )
    if math.isfinite(length):
        numbers |= {f"{key[:-2]}_lengths": value / length for key, value in numbers.items() if key.endswith("_m")}
    return numbers


def _of_zigzag(run: Run, manoeuvre: Manoeuvre) -> dict[str, float]:
    """Overshoots (°), and distance and time of the initial turn."""
    turned = np.degrees(np.unwrap(run["true_heading"]))
    turned -= turned[0]
    flips = np.flatnonzero(np.diff(np.sign(run["yaw"])) != 0.0) + 1
    numbers = {}
    for k, (flip, until) in enumerate(zip(flips, [*flips[1:], len(run)], strict=False), 1):
        if k < len(flips) or until < len(run):
            side = 1.0 if run["yaw"][flip - 1] > 0.0 else -1.0
            numbers[f"overshoot_{k}_deg"] = float((side * turned[flip:until]).max() - manoeuvre.change)
    if len(flips):
        way = np.hypot(np.diff(run["true_north"][: flips[0] + 1]), np.diff(run["true_east"][: flips[0] + 1]))
        numbers["initial_turning_m"] = float(way.sum())
        numbers["initial_turning_s"] = float(run.time[flips[0]] - run.time[0])
    if len(flips) > 2:
        numbers["period_s"] = float(run.time[flips[2]] - run.time[flips[0]])
    return numbers


def _of_circle(run: Run, manoeuvre: Manoeuvre) -> dict[str, float]:
    """Advance, transfer, tactical and steady diameter, and the loss of speed."""
    turned = np.degrees(np.unwrap(run["true_heading"]))
    turned = np.abs(turned - turned[0])
    course = float(run["true_heading"][0])
    north, east = run["true_north"] - run["true_north"][0], run["true_east"] - run["true_east"][0]
    along = north * math.cos(course) + east * math.sin(course)
    across = np.abs(east * math.cos(course) - north * math.sin(course))
    numbers = {"steady_yaw_rate_dps": math.nan, "speed_loss_pct": math.nan, "steady_diameter_m": math.nan}
    for key, values, angle in (
        ("advance_m", along, 90.0),
        ("transfer_m", across, 90.0),
        ("tactical_diameter_m", across, 180.0),
    ):
        numbers[key] = float(values[np.argmax(turned >= angle)]) if turned.max() >= angle else math.nan
    late = turned >= 360.0
    if late.any():
        rate, speed = float(np.abs(run["true_yaw_rate"][late]).mean()), float(run.true_sog[late].mean())
        numbers["steady_yaw_rate_dps"] = math.degrees(rate)
        numbers["speed_loss_pct"] = 100.0 * (1.0 - speed / float(run.true_sog[0]))
        numbers["steady_diameter_m"] = 2.0 * speed / rate
    return numbers


def _of_pull_out(run: Run, manoeuvre: Manoeuvre) -> dict[str, float]:
    """The yaw rates that remain with the helm midships, after a turn to either side: equal for a stable ship."""
    sides = np.sign(run["yaw"])
    ends = [int(row) for row in np.flatnonzero((sides[:-1] == 0.0) & (sides[1:] != 0.0))] + [len(run) - 1]
    rates = [float(np.degrees(run["true_yaw_rate"][row])) for row in ends[:2]]
    after = dict(zip(("first", "second"), rates, strict=False))
    numbers = {f"residual_yaw_rate_{name}_dps": rate for name, rate in after.items()}
    if len(rates) == 2:
        numbers["residual_difference_dps"] = abs(rates[0] - rates[1])
    return numbers


def limits(manoeuvre: Manoeuvre, length: float, speed: float) -> dict[str, float]:
    """Limits of IMO MSC.137(76) for a ship of a length (m) at a speed (m/s); for ships of 100 m and more."""
    if manoeuvre.kind == "turning-circle":
        return {"advance_lengths": 4.5, "tactical_diameter_lengths": 5.0}
    if manoeuvre == ("zigzag", 10.0, 10.0):
        time = min(max(length / speed, 10.0), 30.0)
        return {
            "overshoot_1_deg": 5.0 + 0.5 * time,
            "overshoot_2_deg": 17.5 + 0.75 * time,
            "initial_turning_lengths": 2.5,
        }
    return {"overshoot_1_deg": 25.0} if manoeuvre == ("zigzag", 20.0, 20.0) else {}

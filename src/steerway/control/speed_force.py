"""Speed loops from desired speed to surge force, built on a controller of the shaft speed."""

import math
from typing import Protocol

from steerway.control.speed import AdaptiveSpeed, AdaptiveSpeedGains
from steerway.control.speed_guess import SpeedGuess, signed_root, signed_square
from steerway.control.speed_observer import ObservedSpeed, SpeedObserverGains
from steerway.control.speed_pi import SpeedPI, SpeedPIGains, settled_speed
from steerway.core.errors import InputError

CONTROLLERS = ("pi", "adaptive", "disturbance-observer")
LONGEST_HOLD = 1.0
"""Maximum age (s) of a measured shaft speed; instruments report it at 1 Hz and faster."""


class ShaftController(Protocol):
    """The interface of `AdaptiveSpeed` and `ObservedSpeed`."""

    @property
    def gains(self) -> SpeedGuess: ...

    def restart(self) -> None: ...

    def step(self, setpoint: float, speed: float, dt: float, shaft: float = math.nan) -> float: ...


class ForceLoop:
    """The force is `unit` (N) times n|n|, with n the controller's command.

    The achieved n is `per_rev` times the measured shaft speed (rev/s); without a measurement it follows from the force
    that `limited_to` reports. The desired speed is approached at `acceleration` (m/s²).
    """

    def __init__(
        self, controller: ShaftController, unit: float, acceleration: float = math.inf, per_rev: float = math.nan
    ):
        self.controller, self._unit, self._acceleration, self._per_rev = controller, unit, acceleration, per_rev
        self.restart()

    def restart(self) -> None:
        """Reset the controller."""
        self.controller.restart()
        self.force = 0.0
        self._achieved = self._approached = self._shaft = math.nan
        self._since = math.inf

    def turns(self, shaft: float) -> None:
        """Set the measured shaft speed, rev/s; NaN leaves the last one, which is used for up to `LONGEST_HOLD`."""
        if math.isfinite(shaft):
            self._shaft, self._since = shaft, 0.0

    def step(self, desired: float, speed: float, dt: float, along: float = 0.0) -> float:
        """Surge force (N) for a desired and an actual speed (m/s; NaN for unknown). along: see `SpeedPI.step`."""
        if math.isnan(self._approached):
            self._approached = speed
        if math.isnan(self._approached):
            return 0.0
        most = self._acceleration * dt
        self._approached += max(-most, min(most, desired - self._approached))
        turning = self._shaft * self._per_rev if self._since < LONGEST_HOLD else math.nan
        self._since += dt
        achieved = turning if math.isfinite(turning) else self._achieved
        command = self.controller.step(self._approached + along, speed + along, dt, achieved)
        self.force = self._unit * signed_square(command)
        self._achieved = command
        return self.force

    def speed_of(self, force: float) -> float:
        """Steady speed (m/s) of the guessed boat under a force (N)."""
        guess = self.controller.gains
        return settled_speed(guess.thrust * force / self._unit, guess.linear_drag, guess.quadratic_drag)

    def limited_to(self, achieved: float) -> None:
        """Report the part of the last force (N) that the propellers achieved."""
        self._achieved = signed_root(achieved / self._unit)


def speed_loop(kind: str, gains: SpeedPIGains, full_shaft: float = math.nan) -> SpeedPI | ForceLoop:
    """A speed loop of a kind in CONTROLLERS, designed from the PI gains of a boat.

    The other kinds use mass and drag of the gains as their guess of the boat, and `limit` as full thrust. The bandwidth
    is the rate d_m of their reference model, which settles to 2 % in ln 50/d_m. `full_shaft`: shaft speed (rev/s) at
    full thrust, if the shaft is measured. Raises InputError for an unknown kind, and for gains without a limit or
    without drag.
    """
    if kind == "pi":
        return SpeedPI(gains)
    if kind not in CONTROLLERS:
        raise InputError(f"speed.controller is {kind!r}, expected one of {', '.join(CONTROLLERS)}")
    if gains.limit == math.inf:
        raise InputError(f"speed.controller {kind} needs a limit of the force, expected speed.limit in N")
    guess = {
        "linear_drag": gains.linear_drag / gains.mass,
        "quadratic_drag": gains.quadratic_drag / gains.mass,
        "thrust": gains.limit / gains.mass,
        "low": -math.sqrt(min(gains.limit_astern, gains.limit) / gains.limit),
        "high": 1.0,
        "model_rate": gains.bandwidth,
    }
    controller = (
        AdaptiveSpeed(AdaptiveSpeedGains(**guess)) if kind == "adaptive" else ObservedSpeed(SpeedObserverGains(**guess))
    )
    return ForceLoop(controller, gains.limit, gains.acceleration, 1.0 / full_shaft)

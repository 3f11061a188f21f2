"""Identify a compass from a log of circles: its deviation card, its lag and its noise.

A boat that holds its speed through the water moves over ground by v = U (cos ψ, sin ψ) + c, with the current c. A
compass reads h = ψ + δ(ψ), delayed by a lag; the deviation δ is a card of five coefficients (`sensors.compass`). U, c,
card and lag are fitted to the velocity over ground by nonlinear least squares. In a turn the bow leads the motion by
some time; the identified lag is the compass's lag minus this time.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from steerway.core.angles import wrap_array
from steerway.core.arrays import Floats
from steerway.core.errors import InputError
from steerway.core.records import Fixes, Motion
from steerway.identification.interval import Interval
from steerway.sensors.compass import deviation

LEAST_ROWS = 60
_SECTORS = 8
"""Sectors of the circle, each of which must contain headings: the card has terms in ψ and in 2ψ."""
_TOGETHER = 2.0
"""Correlation time of the errors of velocity, s: about the time over which SOG and COG are smoothed."""
_LONGEST_STEP = 3.0
"""Longest interval between two estimates over which velocity is interpolated, as a multiple of the median interval."""
_NAMES = "A", "B", "C", "D", "E"


@dataclass(frozen=True)
class IdentifiedCompass:
    """A compass: h(t) = ψ(t − lag) + δ(ψ(t − lag)) + noise.

    card: A to E, rad; lag: s, minus the lead of the bow in turns; noise: 1σ of a reading, rad; speed through the water
    and current (north, east), m/s; residual: RMS (rad) of corrected heading minus direction of motion through the
    water; samples: readings used.
    """

    card: tuple[Interval, ...]
    lag: Interval
    noise: float
    speed: float
    current: tuple[float, float]
    residual: float
    samples: int

    def toml(self) -> str:
        """The `[compass]` table of a scenario."""
        card = ", ".join(f"{math.degrees(each.value):.2f}" for each in self.card)
        return f"[compass]\nstd_deg = {max(math.degrees(self.noise), 0.01):.2g}\ndeviation_deg = [{card}]\n"

    def rows(self) -> list[tuple[str, str]]:
        """(what, value) of each number, with 95 % intervals."""
        degrees = (Interval(*map(math.degrees, each)) for each in self.card)
        return [
            *((f"coefficient {name}", f"{each}°") for name, each in zip(_NAMES, degrees, strict=True)),
            ("lag minus lead of the bow", f"{self.lag} s"),
            ("noise of a reading", f"{math.degrees(self.noise):.2g}°"),
            ("residual", f"{math.degrees(self.residual):.2g}° RMS"),
            ("speed through the water", f"{self.speed:.2f} m/s"),
            ("current", f"{math.hypot(*self.current):.2f} m/s"),
            ("identified from", f"{self.samples} readings"),
        ]


def identify_compass(fixes: Fixes, motion: Motion) -> IdentifiedCompass:
    """Identify the compass whose headings are in a log.

    Args:
        fixes: a log with headings, of circles to both sides at constant throttle.
        motion: its estimate, smoothed.

    Raises InputError for fewer than 60 headings, and if an eighth of the circle contains none.
    """
    time, heading, velocity = _readings(fixes, motion)
    speed = float(np.median(np.hypot(*velocity)))

    def directions(card: Floats) -> Floats:
        bow = heading
        for _ in range(3):  # the card is a function of the true heading, which is found by iteration
            bow = heading - deviation(bow, *card)
        return bow

    def before(lag: float) -> Floats:
        return np.stack([np.interp(time - lag, time, each) for each in velocity])

    def errors(x: Floats) -> Floats:
        bow = directions(x[3:8])
        return (np.stack([np.cos(bow), np.sin(bow)]) * x[0] + x[1:3, np.newaxis] - before(x[8])).ravel()

    found = least_squares(errors, np.r_[speed, np.zeros(8)], loss="soft_l1", f_scale=0.1 * speed)
    off = errors(found.x).reshape(2, -1)
    alike = max(1.0, _TOGETHER / float(np.median(np.diff(time))))
    variance = float(np.mean(off**2)) * alike * len(time) / max(len(time) - 9.0, 1.0)
    std = np.sqrt(variance * np.diag(np.linalg.pinv(found.jac.T @ found.jac)))
    each = [Interval.around(value, one) for value, one in zip(found.x, std, strict=True)]
    north, east = before(found.x[8])
    towards = np.arctan2(east - found.x[2], north - found.x[1])
    third = np.abs(np.diff(np.unwrap(heading), 3))
    return IdentifiedCompass(
        card=tuple(each[3:8]),
        lag=each[8],
        noise=float(np.median(third)) / (0.6745 * math.sqrt(20.0)),
        speed=float(found.x[0]),
        current=(float(found.x[1]), float(found.x[2])),
        residual=float(np.sqrt(np.mean(wrap_array(towards - directions(found.x[3:8])) ** 2))),
        samples=len(time),
    )


def _readings(fixes: Fixes, motion: Motion) -> tuple[Floats, Floats, Floats]:
    """(n,) seconds since the first reading, (n,) headings, and the velocity over ground (2, n) at these times."""
    if fixes.mmsi is not None:
        raise InputError("the log has several vessels, expected a log of one vessel with headings")
    read, known = np.isfinite(fixes.heading), np.isfinite(motion.sog) & np.isfinite(motion.cog)
    if read.sum() < LEAST_ROWS or known.sum() < LEAST_ROWS:
        raise InputError(
            f"the log has {read.sum()} headings and {known.sum()} rows with a course, expected {LEAST_ROWS} of each"
        )
    time, sog, cog = motion.time[known], motion.sog[known], motion.cog[known]
    after = np.searchsorted(time, fixes.time).clip(1, len(time) - 1)
    near = time[after] - time[after - 1] <= _LONGEST_STEP * float(np.median(np.diff(time)))
    near &= read & (fixes.time >= time[0]) & (fixes.time <= time[-1])
    at, first = np.unique(fixes.time[near], return_index=True)
    heading = fixes.heading[near][first]
    sectors = np.unique(np.floor(np.mod(heading, math.tau) / math.tau * _SECTORS).clip(0, _SECTORS - 1))
    if len(sectors) < _SECTORS or len(at) < LEAST_ROWS:
        raise InputError(
            f"headings under way lie in {len(sectors)} of {_SECTORS} sectors of the circle ({len(at)} rows), expected "
            f"all of them, in at least {LEAST_ROWS} rows: sail full circles to both sides at constant throttle"
        )
    velocity = np.stack([np.interp(at, time, sog * np.cos(cog)), np.interp(at, time, sog * np.sin(cog))])
    return at - at[0], heading, velocity

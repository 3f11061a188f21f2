"""Scene set `rounded`: generated records with known truth, whose positions are written with few digits.

A cell is a last digit and a rate of fixes. Its records are of boats that are moored, drift, go straight on eight
courses or turn; their receivers have white noise, half of them a slow error too.
"""

import math
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

import steerway
from steerway.core import ECCENTRICITY_SQUARED, NORMAL_95, SEMI_MAJOR_AXIS, wrap_array
from steerway.estimation import choose_profile
from steerway_studies.study import Results, over_cases

HOME = math.radians(50.123456), math.radians(-4.234567)
DIGITS = {"0.01'": 0.01 / 60.0, "0.001'": 0.001 / 60.0, "4 decimals": 1e-4, "5 decimals": 1e-5, "6 decimals": 1e-6}
"""Last digit of a position, degrees."""
RATES = 0.1, 0.5, 1.0, 5.0  # fixes a second
FIXES, LONGEST, SETTLING = 300, 1200.0, 0.1
"""Most fixes and greatest length (s) of a record; share at its beginning that is not judged."""
SPEEDS = 0.3, 0.7, 1.3, 2.0, 3.0, 5.0, 7.5, 10.0
"""Speeds (m/s) on the eight straight courses."""
WHITE, SLOW = 0.1, (0.5, 60.0)
"""White noise (m); slow error: standard deviation (m) and time constant (s)."""
RESOLVED = 3.0
"""The bias of SOG is judged if the boat moves by more than this many last digits from the first to the last fix."""
_FINE = 0.02  # s, step of the simulation


class Case(NamedTuple):
    """A record: digit (a key of DIGITS), fixes a second, motion, whether there is a slow error, seed."""

    digit: str
    rate: float
    motion: str
    is_slow: bool
    seed: int


MOTIONS = ("moored", "drifting", *(f"straight {k}" for k in range(len(SPEEDS))), "turning")


@dataclass(frozen=True)
class Verdict:
    """Numbers of a causal or smoothed estimate: RMS and mean error of SOG (m/s), RMS error of COG (rad), shares inside
    the 95 % intervals, the least σ of SOG, and the floor that this σ must reach; NaN without a course."""

    sog: float
    bias: float
    cog: float
    sog_cover: float
    cog_cover: float
    least_std: float
    floor: float


def sailed(case: Case):
    """(time, places (n, 2), sog, cog) of a boat at its fixes."""
    duration = min(FIXES / case.rate, LONGEST)
    time = np.arange(0.0, duration, _FINE)
    speed, course, rate = 0.0, 0.4, np.zeros(len(time))
    if case.motion == "drifting":
        speed, rate = 0.2, np.radians(0.2) * np.sin(time / 50.0)
    elif case.motion == "turning":
        speed, rate = 2.5, np.radians(60.0) / 30.0 * np.sin(2.0 * math.pi * time / 120.0)
    elif case.motion != "moored":
        k = int(case.motion.split()[1])
        speed, course = SPEEDS[k], 0.1 + 0.25 * math.pi * k
    cog = course + np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * _FINE)])
    middle = np.concatenate([[course], 0.5 * (cog[1:] + cog[:-1])])
    way = speed * _FINE * np.column_stack([np.cos(middle), np.sin(middle)])
    way[0] = 0.0
    rows = np.arange(0, len(time), round(1.0 / case.rate / _FINE))
    return time[rows], np.cumsum(way, axis=0)[rows], np.full(len(rows), speed), wrap_array(cog[rows])


def written(case: Case, time, places) -> steerway.Fixes:
    """The fixes with noise and rounded positions."""
    random = np.random.default_rng([case.seed, MOTIONS.index(case.motion), int(10.0 * case.rate)])
    error = WHITE * random.standard_normal(places.shape)
    if case.is_slow:
        std, lasts = SLOW
        left = math.exp(-1.0 / case.rate / lasts)
        slow = std * random.standard_normal(2)
        for row in error:
            row += slow
            slow = left * slow + std * math.sqrt(1.0 - left * left) * random.standard_normal(2)
    digit = DIGITS[case.digit]
    latitude, longitude = (np.radians(np.round(np.degrees(x) / digit) * digit) for x in geodetic(places + error))
    return steerway.Fixes(1.7e9 + time, latitude, longitude)


def geodetic(places):
    """Latitude and longitude (n,) rad of places (n, 2) m, summed from one to the next."""
    w = 1.0 - ECCENTRICITY_SQUARED * math.sin(HOME[0]) ** 2
    prime_vertical = SEMI_MAJOR_AXIS / math.sqrt(w)
    latitude = HOME[0] + places[:, 0] * w / (prime_vertical * (1.0 - ECCENTRICITY_SQUARED))
    middle = np.append(HOME[0], 0.5 * (latitude[1:] + latitude[:-1]))
    return latitude, HOME[1] + np.cumsum(np.diff(places[:, 1], prepend=0.0) / (prime_vertical * np.cos(middle)))


def judge(case: Case) -> tuple[Verdict, Verdict]:
    """Verdicts on the default estimate of a record, causal and smoothed."""
    time, places, sog, cog = sailed(case)
    fixes = written(case, time, places)
    profile = choose_profile(fixes)
    verdicts = []
    for smooth in (False, True):
        motion = steerway.estimate(fixes, profile, smooth=smooth)
        rows = (time > SETTLING * time[-1]) & np.isfinite(motion.sog)
        off, turned = motion.sog - sog, wrap_array(motion.cog - cog)
        course = rows & np.isfinite(turned) & (sog > 0.0)
        width = math.radians(DIGITS[case.digit]) * SEMI_MAJOR_AXIS * math.cos(HOME[0]) / math.sqrt(12.0)
        held = np.abs(off) < NORMAL_95 * motion.sog_std, np.abs(turned) < NORMAL_95 * motion.cog_std
        verdicts.append(
            Verdict(
                sog=math.sqrt(np.mean(off[rows] ** 2)),
                bias=float(np.mean(off[rows])),
                cog=math.sqrt(np.mean(turned[course] ** 2)) if course.any() else math.nan,
                sog_cover=float(np.mean(held[0][rows])),
                cog_cover=float(np.mean(held[1][course])) if course.any() else math.nan,
                least_std=float(np.min(motion.sog_std[rows])),
                floor=math.sqrt(12.0 / len(time)) * width / float(time[-1] - time[0]),
            )
        )
    return tuple(verdicts)


def cases(seed: int) -> list[Case]:
    """All cells with all motions, each with white noise or a slow error, alternately."""
    kinds = product(DIGITS, RATES, enumerate(MOTIONS))
    return [Case(digit, rate, motion, (k + seed) % 2 == 1, seed) for digit, rate, (k, motion) in kinds]


def cells(seed: int = 0, progress=None) -> dict[tuple[str, float], list[tuple[Case, tuple[Verdict, Verdict]]]]:
    """All cases with their verdicts, by digit and rate."""
    chosen = cases(seed)
    found: dict[tuple[str, float], list[tuple[Case, tuple[Verdict, Verdict]]]] = {}
    for case, both in zip(chosen, over_cases(judge, chosen, progress=progress), strict=True):
        found.setdefault((case.digit, case.rate), []).append((case, both))
    return found


def bias(of_cell, which: int) -> float:
    """Largest |mean error| of SOG over the speed, among a cell's straight records that resolve it; 0 if none does."""
    shares = [0.0]
    for case, verdicts in of_cell:
        if case.motion.startswith("straight"):
            speed = SPEEDS[int(case.motion.split()[1])]
            if speed * min(FIXES / case.rate, LONGEST) > RESOLVED * math.radians(DIGITS[case.digit]) * SEMI_MAJOR_AXIS:
                shares.append(abs(verdicts[which].bias) / speed)
    return max(shares)


def add_to(results: Results, seed: int) -> None:
    """Add the numbers of all cells and their table to the results."""
    found = cells(seed)
    results.section = f"Rounded positions, {sum(map(len, found.values()))} generated records"
    for which, prefix, words in ((0, "", "causal"), (1, "smoothed_", "smoothed")):
        for key, what in (("sog", "SOG"), ("cog", "COG")):
            by_cell = {cell: covered(of_cell, which, key) for cell, of_cell in found.items()}
            least = min(by_cell, key=lambda cell: by_cell[cell] if math.isfinite(by_cell[cell]) else math.inf)
            told = f"{words}: coverage of the 95 % interval of {what}, least cell: {named(least)}"
            value = by_cell[least]
            results.compare(
                f"rounded_{prefix}{key}_coverage_min_pct", value, told, "%", target="≥ 90", met=value >= 90.0
            )
        biases = {cell: 100.0 * bias(of_cell, which) for cell, of_cell in found.items()}
        worst = max(biases, key=biases.get)
        told = f"{words}: mean error of SOG where resolved, worst cell: {named(worst)}"
        value = biases[worst]
        results.compare(f"rounded_{prefix}bias_max_pct", value, told, "% of it", target="≤ 2", met=value <= 2.0)
        below = sum(both[which].least_std < both[which].floor for each in found.values() for _, both in each)
        told = f"{words}: records with a σ of SOG below the floor that their fixes allow"
        results.compare(f"rounded_{prefix}below_floor", below, told, target="0", met=below == 0)
    results.tables.append(
        ("Rounded positions: RMS error of SOG (m/s), coverage (%)", _COLUMNS, list(map(_row, found.items())))
    )


_COLUMNS = ("cell", "records", "SOG causal", "smoothed", "cover s/c causal", "smoothed")


def _row(item) -> tuple:
    cell, of_cell = item
    errors = [math.sqrt(np.mean([both[which].sog ** 2 for _, both in of_cell])) for which in (0, 1)]
    covers = ["/".join(f"{covered(of_cell, which, key):.0f}" for key in ("sog", "cog")) for which in (0, 1)]
    return (named(cell), str(len(of_cell)), *(f"{each:.3f}" for each in errors), *covers)


def covered(of_cell, which: int, key: str) -> float:
    """Mean coverage (%) of SOG or COG over the records of a cell that have it; NaN if none has."""
    known = [share for _, both in of_cell if math.isfinite(share := getattr(both[which], f"{key}_cover"))]
    return 100.0 * float(np.mean(known)) if known else math.nan


def named(cell) -> str:
    """A cell in words."""
    return f"{cell[0]}, {cell[1]:g} Hz"

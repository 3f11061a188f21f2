"""A generated AIS archive with the truth: days of reports in the layout of the Danish authority.

Ships of class A and B under way, moored and alternating, report every 2 to 180 s; receivers miss hours; some pairs of
ships share an MMSI, single reports jump, rows are out of order and partly doubled, and values that mean "unknown"
(91°, 181°, 102.3 kn, 360°, 511°) stand where AIS has them. Base stations, aids to navigation and aircraft report too.

python -m tests.fleet DIRECTORY [SHIPS [DAYS [SEED]]]
"""

import contextlib
import datetime
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from steerway.core import radii

DAY = 86_400
FIRST_DAY = datetime.date(2024, 3, 1)
_GRID = 2.0  # s, of the motion
_SHIPS_AT_ONCE = 100
_SHARED = 0.04  # part of the ships that use the MMSI of another
_JUMPS = 4e-4  # part of the reports whose position is wrong
_POSITION_STD = {"Class A": 3.0, "Class B": 6.0}


@dataclass(frozen=True)
class Ship:
    """What stays of a ship over all days."""

    mmsi: int
    mobile: str
    length: float
    width: float
    kind: str
    latitude_deg: float
    longitude_deg: float
    activity: str


def ships(count: int, rng) -> list[Ship]:
    """The fleet; the last of it use the numbers of the first."""
    fleet, shared = [], int(count * _SHARED)
    for i in range(count):
        mobile = "Class A" if rng.random() < 0.7 else "Class B"
        activity = str(rng.choice(["moored", "under way", "both"], p=[0.3, 0.4, 0.3]))
        number = 219_000_000 + 17 * i
        if i >= count - shared:
            number = fleet[i - count + shared].mmsi
            activity = "under way" if rng.random() < 0.7 else "both"
        length = float(np.round(rng.lognormal(4.3, 0.6) if mobile == "Class A" else rng.uniform(6, 24)))
        kind = str(rng.choice(["Cargo", "Tanker", "Passenger", "Fishing"])) if mobile == "Class A" else "Pleasure"
        place = rng.uniform(54.5, 58.0), rng.uniform(7.0, 14.0)
        fleet.append(Ship(number, mobile, length, float(np.ceil(length / 6)), kind, *place, activity))
    return fleet


def _motion(ship: Ship, seconds: float, rng) -> tuple[np.ndarray, ...]:
    """Time, latitude, longitude (rad), speed and course on a grid: legs joined by turns, about a service speed."""
    time = np.arange(0.0, seconds + 2 * _GRID, _GRID)
    n = len(time)
    service = rng.uniform(4.0, 10.0) if ship.mobile == "Class A" else rng.uniform(2.0, 8.0)
    sailing = np.full(n, ship.activity != "moored")
    if ship.activity == "both":
        edges = np.cumsum(rng.exponential(4 * 3600.0, 2 + int(seconds / 3600)))
        sailing = np.searchsorted(edges, time) % 2 == 0
    wander = _smoothed(rng.normal(size=n), 60.0) * 0.04 * service
    speed = np.maximum(_smoothed(np.where(sailing, service, 0.0), 90.0, start=float(sailing[0]) * service), 0.0)
    speed = np.where(speed > 0.3, np.maximum(speed + wander, 0.0), 0.0)
    rate = np.zeros(n)
    for start in np.cumsum(rng.exponential(1500.0, int(seconds / 1000) + 3)):
        k, duration = int(start / _GRID), rng.uniform(20.0, 120.0)
        if k < n:
            turn = np.radians(rng.normal(0.0, 40.0))
            rate[k : k + int(duration / _GRID)] = turn / duration
    rate = _smoothed(rate, 10.0) + _smoothed(rng.normal(size=n), 20.0) * 4e-4
    course = rng.uniform(-np.pi, np.pi) + np.cumsum(rate) * _GRID
    meridian, prime_vertical = radii(np.radians(ship.latitude_deg))
    latitude = np.radians(ship.latitude_deg) + np.cumsum(speed * np.cos(course)) * _GRID / meridian
    longitude = np.cumsum(speed * np.sin(course) / np.cos(latitude)) * _GRID / prime_vertical
    return time, latitude, np.radians(ship.longitude_deg) + longitude, speed, course


def _smoothed(values, time_constant, start=0.0):
    from scipy.signal import lfilter

    left = np.exp(-_GRID / time_constant)
    gain = 1.0 - left
    if start == 0.0 and abs(values.mean()) < 0.5:  # noise keeps its standard deviation
        gain = np.sqrt(1.0 - left**2)
    return lfilter([gain], [1.0, -left], values, zi=[left * start])[0]


def _report_times(ship: Ship, seconds: float, speed, rng) -> np.ndarray:
    """Whole seconds; by class and speed as ITU-R M.1371 asks, seen by a receiver that misses many and at times all."""
    times, t = [], rng.uniform(0.0, 60.0)
    usual = {"Class A": (10.0, 180.0), "Class B": (30.0, 180.0)}[ship.mobile]
    reception = rng.uniform(0.25, 0.7)
    gaps = np.sort(rng.uniform(0.0, seconds, rng.poisson(seconds / 30_000.0)))
    ends = gaps + rng.exponential(2400.0, len(gaps))
    draws = iter(rng.random(1 << 20))
    while t < seconds:
        moving = speed[int(t / _GRID)]
        interval = usual[1] if moving < 1.5 else usual[0]
        if ship.mobile == "Class A" and moving > 7.2:
            interval = 6.0
        k = np.searchsorted(gaps, t)
        if next(draws) < reception and not (k and t < ends[k - 1]):
            times.append(round(t))
        t += max(interval * (0.9 + 0.2 * next(draws)), 2.0)
    return np.unique(np.array(times, dtype=np.int64))


def _reports(number: int, ship: Ship, seconds: float, rng) -> pl.DataFrame:
    """The reports of one ship with the truth in the columns `ship` and `jump`."""
    time, latitude, longitude, speed, course = _motion(ship, seconds, rng)
    at = _report_times(ship, seconds, speed, rng)
    n = len(at)
    stamped = at - rng.uniform(0.0, 1.0, n)
    latitude, longitude, sog = (np.interp(stamped, time, each) for each in (latitude, longitude, speed))
    cog = np.interp(at, time, course)
    std = _POSITION_STD[ship.mobile]
    jump = rng.random(n) < _JUMPS
    away, towards = 10.0 ** rng.uniform(3.0, 5.0, n), rng.uniform(-np.pi, np.pi, n)
    north = rng.normal(0.0, std, n) + jump * away * np.cos(towards)
    east = rng.normal(0.0, std, n) + jump * away * np.sin(towards)
    longitude = np.degrees(longitude + east / (6.37e6 * np.cos(latitude)))
    longitude = (longitude + 180.0) % 360.0 - 180.0
    latitude = np.degrees(latitude + north / 6.37e6)
    unknown = rng.random((4, n)) < [[0.002], [0.004], [0.01], [0.3]]
    knots = np.round(np.abs(sog + rng.normal(0.0, 0.05, n)) / 0.514444, 1)
    compass = np.round(np.degrees(cog + rng.normal(0.0, 0.01, n)) % 360.0, 1) % 360.0
    return pl.DataFrame(
        {
            "at": at,
            "Type of mobile": pl.Series([ship.mobile]).new_from_index(0, n),
            "MMSI": np.full(n, ship.mmsi),
            "Latitude": np.where(unknown[0], 91.0, np.round(latitude, 6)),
            "Longitude": np.where(unknown[0], 181.0, np.round(longitude, 6)),
            "SOG": np.where(unknown[1], 102.3, knots),
            "COG": np.where(unknown[2], 360.0, compass),
            "Heading": np.where(unknown[3], 511.0, np.round(compass) % 360.0),
            "Ship type": pl.Series([ship.kind]).new_from_index(0, n),
            "Width": np.full(n, ship.width),
            "Length": np.full(n, ship.length),
            "ship": np.full(n, number, np.int32),
            "jump": jump & ~unknown[0],
            "true_sog": sog,
        }
    )


def _fixed_stations(count: int, seconds: float, rng) -> pl.DataFrame:
    """Base stations, aids to navigation and aircraft, every half minute."""
    unknown = {"SOG": 0.0, "COG": 360.0, "Heading": 511.0, "Ship type": "Undefined", "Width": 0.0, "Length": 0.0}
    unknown |= {"jump": False, "true_sog": 0.0}
    kinds, frames = (("Base Station", 2_190_000), ("AtoN", 992_190_000), ("SAR Airborne", 111_219_000)), []
    for i in range(count):
        mobile, first = kinds[i % 3]
        at = np.arange(rng.integers(0, 30), int(seconds), 30)
        moving = np.cumsum(rng.normal(0.0, 0.01, len(at))) if mobile == "SAR Airborne" else np.zeros(len(at))
        latitude = np.round(np.clip(55.0 + i * 0.01 + moving, 50.0, 60.0), 6)
        own = {"Type of mobile": mobile, "MMSI": first + i, "Longitude": 10.0 + i * 0.01, "ship": np.int32(-1 - i)}
        own |= unknown
        frame = pl.DataFrame({"at": at, "Latitude": latitude})
        frames.append(frame.with_columns(**{name: pl.lit(value) for name, value in own.items()}))
    return pl.concat(frames)


def day_path(directory: Path, day: int) -> Path:
    """The file of a day."""
    return directory / f"aisdk-{FIRST_DAY + datetime.timedelta(days=day)}.csv"


def generate(directory: Path, count: int = 500, days: int = 3, seed: int = 1) -> int:
    """Write a CSV a day, and truth.parquet (as reported, with ship, jump and SOG); returns the rows."""
    directory = Path(directory)
    directory.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(seed)
    fleet, seconds, truth, rows = ships(count, rng), days * DAY, [], 0
    with contextlib.ExitStack() as opened:
        files = [opened.enter_context(open(day_path(directory, day), "wb")) for day in range(days)]
        for first in range(0, count, _SHIPS_AT_ONCE):
            some = [_reports(first + i, each, seconds, rng) for i, each in enumerate(fleet[first:][:_SHIPS_AT_ONCE])]
            if first == 0:
                some.append(_fixed_stations(max(count // 50, 3), seconds, rng))
            frame = pl.concat(some, how="diagonal_relaxed")
            doubled = frame.filter(pl.Series(rng.random(len(frame)) < 0.003))
            frame = pl.concat([frame, doubled])
            late = frame["at"].to_numpy() + rng.uniform(0.0, 1.0, len(frame)) + 20.0 * (rng.random(len(frame)) < 0.01)
            frame = frame[np.argsort(late, kind="stable")]
            rows += len(frame)
            truth.append(_truth(frame))
            for day, file in enumerate(files):
                some_day = frame.filter(pl.col("at") // DAY == day)
                _dma(some_day).write_csv(file, include_header=first == 0)
    pl.concat(truth).write_parquet(directory / "truth.parquet")
    return rows


def _times(frame):
    return pl.lit(FIRST_DAY).cast(pl.Datetime("us")) + pl.duration(seconds=frame["at"])


def _truth(frame):
    names = {"mmsi": "MMSI", "lat_deg": "Latitude", "lon_deg": "Longitude", "sog_mps": "true_sog"}
    return frame.select("ship", "jump", time_s=_times(frame).to_physical() / 1e6, **names)


def _dma(frame):
    """The columns of the Danish files that anybody reads."""
    time = _times(frame).dt.strftime("%d/%m/%Y %H:%M:%S").alias("# Timestamp")
    return frame.select(time, pl.exclude("at", "ship", "jump", "true_sog"))


if __name__ == "__main__":
    print(f"{generate(Path(sys.argv[1]), *map(int, sys.argv[2:])):,} rows")

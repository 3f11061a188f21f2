"""Epochs of a receiver on a boat that sails straight on, and the faults that change them."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from steerway.core import wrap
from steerway.core.testing import displaced
from steerway.formats.testing import ROLLOVER
from tests.sentences import KNOT, clock, place, sealed

SPEED, COURSE = 2.0, math.radians(60.0)
RATE, STD, DELAY, JITTER = 5.0, 0.1, 0.08, 0.03  # Hz, m, s, s
BEGIN, LENGTH, AFTER = 60.0, 20.0, 30.0
"""Begin of a fault from the start of the sortie, length of faults that last, and time to the end of the sortie, s."""
NOON = 1_719_835_200.0  # 2024-07-01 12:00 UTC
MIDNIGHT = 1_719_878_400.0 - BEGIN
HOME = math.radians(54.0), math.radians(10.0)
BY_THE_LINE = math.radians(0.0), math.radians(180.0) - SPEED * math.sin(COURSE) * BEGIN / 6378137.0


@dataclass(frozen=True)
class Epoch:
    """One fix as sent; `time` and `date` are the receiver's, `sent` is s from the start of the sortie."""

    sent: float
    time: float
    latitude: float
    longitude: float
    valid: bool = True
    keeps_place: bool = False  # whether an invalid fix has a position
    cog: bool = True
    date: float = 0.0  # s by which the date of RMC is wrong
    link: int = 0
    talker: str = "GP"

    def output(self) -> bytes:
        """GGA and RMC."""
        spot = place(math.degrees(self.latitude), math.degrees(self.longitude))
        quality, status, mode = (1, "A", "A") if self.valid else (0, "V", "N")
        if not (self.valid or self.keeps_place):
            spot = ",,,"
        motion = f"{SPEED / KNOT:.3f},{math.degrees(COURSE):.2f}" if self.cog and self.valid else ","
        hour, date = clock(self.time)[0], clock(self.time + self.date)[1]
        return sealed(f"{self.talker}GGA,{hour},{spot},{quality},10,0.9,1.0,M,47.0,M,,") + sealed(
            f"{self.talker}RMC,{hour},{status},{spot},{motion},{date},,,{mode}"
        )


@dataclass(frozen=True)
class Fault:
    """A change of the epochs, which lasts until `until`. `wanted`: sources by priority; `moved`: true displacement of
    the boat to the east at BEGIN, m; `stepped`: step of the receiver's clock, s; `delay`: smallest delay of fixes, s;
    `latency`: the setting of the service, s."""

    name: str
    alter: Callable[[list[Epoch]], list[Epoch]] = list
    until: float = BEGIN + LENGTH
    start: float = NOON
    home: tuple[float, float] = HOME
    wanted: tuple[str, ...] = ()
    moved: float = 0.0
    stepped: float = 0.0
    links: int = 1
    delay: float = DELAY
    latency: float = DELAY

    @property
    def end(self) -> float:
        """End of the sortie, s from its start."""
        return self.until + AFTER

    def truth(self, second: float) -> tuple[float, float]:
        """Latitude and longitude of the boat, rad."""
        east = SPEED * math.sin(COURSE) * second + (self.moved if second >= BEGIN else 0.0)
        return displaced(*self.home, SPEED * math.cos(COURSE) * second, east)

    def epochs(self) -> list[Epoch]:
        """The epochs in the order in which they are sent."""
        rng = np.random.default_rng(20240701)
        made = []
        for k in range(round(self.end * RATE)):
            place = displaced(*self.truth(k / RATE), *rng.normal(0.0, STD, 2))
            sent = k / RATE + self.delay + JITTER * rng.random()
            made.append(Epoch(sent, self.start + k / RATE, place[0], wrap(place[1])))
        return sorted(self.alter(made), key=lambda each: each.sent)


def _during(length, change):
    """Change the epochs from BEGIN on for `length` s; a change to None drops the epoch."""

    def alter(epochs):
        begin = epochs[0].time + BEGIN - 1e-6
        changed = [change(each) if begin <= each.time < begin + length else each for each in epochs]
        return [each for each in changed if each is not None]

    return alter


def _moved(epoch, north=0.0, east=0.0):
    latitude, longitude = displaced(epoch.latitude, epoch.longitude, north, east)
    return replace(epoch, latitude=latitude, longitude=wrap(longitude))


def _dropout(length):
    return Fault(f"no fix for {length:g} s", _during(length, lambda _: None), BEGIN + length)


def _stepped(name, by):
    return Fault(name, _during(math.inf, lambda each: replace(each, time=each.time + by)), BEGIN, stepped=by)


def _frozen(epochs):
    stuck = next(each for each in epochs if each.time >= epochs[0].time + BEGIN)
    return _during(LENGTH, lambda each: replace(each, latitude=stuck.latitude, longitude=stuck.longitude))(epochs)


def _late(epochs):
    return [
        replace(each, sent=each.sent + 1.0) if k % 5 == 0 and BEGIN <= k / RATE < BEGIN + LENGTH else each
        for k, each in enumerate(epochs)
    ]


def _swapped(epochs):
    swapped = list(epochs)
    for k in range(round(BEGIN * RATE), round((BEGIN + LENGTH) * RATE), 2):
        swapped[k] = replace(epochs[k], sent=epochs[k + 1].sent + 0.06)
    return swapped


def _held_back(epochs):
    return _during(3.0, lambda each: replace(each, sent=BEGIN + 3.0 + 1e-4 * (each.sent - BEGIN)))(epochs)


def _doubled(epochs):
    return [each for epoch in epochs for each in (epoch, replace(epoch, sent=epoch.sent + 0.06))]


def _one_stray(by):
    return lambda epochs: [
        replace(each, time=each.time + by) if k == round(BEGIN * RATE) else each for k, each in enumerate(epochs)
    ]


def _two_receivers(stops=None):
    """Add a second, noisier receiver 20 m to the east, half an interval later; stop the first for `stops` s."""

    def alter(epochs):
        second = [
            replace(_moved(each, 0.1 * (-1.0) ** k, 20.0), link=1, talker="GN", sent=each.sent + 0.1)
            for k, each in enumerate(epochs)
        ]
        first = epochs if stops is None else _during(stops, lambda _: None)(epochs)
        return first + second

    return alter


def _another_hour(epochs):
    return [replace(each, time=each.time + 3600.0) if each.link else each for each in _two_receivers()(epochs)]


def _day_late(epochs):
    return _during(1.0, lambda each: replace(each, date=-86400.0))(epochs)


def _rolled_over(epochs):
    return [replace(each, time=each.time - ROLLOVER) for each in epochs]


_ALL = (
    Fault("none", until=BEGIN),
    *map(_dropout, (1.0, 5.0, 15.0, 60.0)),
    Fault("jump of 30 m for 1 s", _during(1.0, lambda each: _moved(each, north=30.0)), BEGIN + 1.0),
    Fault("jump of 30 m that stays", until=BEGIN, moved=30.0),
    Fault("position frozen for 20 s", _frozen),
    Fault("every fix repeated", _doubled),
    Fault("every fifth fix 1 s late", _late),
    Fault("every fix 0.3 s late, --latency 0.3", until=BEGIN, delay=0.3, latency=0.3),
    Fault("every fix 0.3 s late, --latency 0", until=BEGIN, delay=0.3, latency=0.0),
    Fault("fixes in the wrong order", _swapped),
    Fault("link silent for 3 s, then all at once", _held_back, BEGIN + 3.0),
    Fault("one time an hour ahead", _one_stray(3600.0), BEGIN + 1.0),
    Fault("one time 30 s ahead", _one_stray(30.0), BEGIN + 1.0),
    _stepped("clock steps 1 h forward", 3600.0),
    _stepped("clock steps 1 h back", -3600.0),
    _stepped("clock steps 18 s forward", 18.0),
    _stepped("clock steps 18 s back", -18.0),
    _stepped("clock steps 2 s forward", 2.0),
    _stepped("clock steps 2 s back", -2.0),
    Fault("midnight", until=BEGIN, start=MIDNIGHT),
    Fault("midnight, the date 1 s late", _day_late, BEGIN + 1.0, start=MIDNIGHT),
    Fault("date 1024 weeks early", _rolled_over, BEGIN),
    Fault("across ±180°", until=BEGIN, home=BY_THE_LINE),
    Fault("COG and SOG empty", _during(LENGTH, lambda each: replace(each, cog=False))),
    Fault("status V for 5 s", _during(5.0, lambda each: replace(each, valid=False)), BEGIN + 5.0),
    Fault(
        "status V with a position for 20 s", _during(LENGTH, lambda each: replace(each, valid=False, keeps_place=True))
    ),
    Fault("two receivers 20 m apart", _two_receivers(), BEGIN, links=2),
    Fault("… the second's clock an hour ahead", _another_hour, BEGIN, links=2),
    Fault("… the first silent for 20 s", _two_receivers(LENGTH), links=2),
    Fault("… the same with --source GP --source GN", _two_receivers(LENGTH), links=2, wanted=("GP", "GN")),
)
FAULTS = {each.name: each for each in _ALL}

"""Running: weighed structures that are filtered together, fix by fix, with their whole state in one array."""

import math
from collections.abc import Sequence
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np

from steerway.core.angles import wrap, wrap_array
from steerway.core.arrays import Floats
from steerway.core.gaps import LONGEST_GAP
from steerway.core.linear_algebra import symmetric
from steerway.estimation.filter import five_state
from steerway.estimation.filter.model import COURSE, FUSED, SPEED, Bank, Model, bank_in, bank_size, packed
from steerway.estimation.log.copies import FEW_STEPS, HELD
from steerway.estimation.log.course import EAST, NORTH, POSITION_STD, RATE, SOG, average, least_course_speed
from steerway.estimation.log.plane import covariance_from_north
from steerway.estimation.stream_row import (
    AZIMUTH,
    COARSE,
    ELAPSED,
    FADED,
    HEADER,
    KNOWN,
    LAST_SOG,
    LATITUDE,
    LOG_DENSITY,
    LONGITUDE,
    SINCE,
    Alike,
    doubt_slide,
    origin_of,
    place_of,
    read,
    read_plain,
    settle,
    step,
    step_plain,
    true_course,
)
from steerway.estimation.vessel.aids import AIDS, NO_AIDS
from steerway.estimation.vessel.flat import Weighed, WeighedModel

FADE = 10.0
"""Time, s, in which the estimate blends from one set of structures to the next: a few fixes of a usual receiver."""
_LEAST_SPEED = 1e-6  # m/s: least divisor for a speed
LEAST_LOG_WEIGHT = -40.0
"""Least log weight of a structure whose weight is learned. No structure is excluded for ever, since it may predict
fixes badly now and well later. e⁻⁴⁰ is 4·10⁻¹⁸, below the rounding of the sum of weights."""


class Set(NamedTuple):
    """Structures that are filtered together."""

    structures: tuple[Model, ...]  # those that fade out first
    weights: tuple[float, ...]  # at the start; where structures fade out, at the end of the fading
    fading: int  # number of structures that fade out
    fading_weights: tuple[float, ...]  # their weights when the fading began
    learns: bool  # whether the weights are multiplied by the likelihood of every fix


def set_of(structures: Sequence[Weighed], learns: bool = False) -> Set:
    """The set of weighed structures."""
    return Set(tuple(each.model for each in structures), tuple(each.weight for each in structures), 0, (), learns)


class Running:
    """A `Set` and the state of its filters.

    Attributes:
        state: one array of a header (see `stream_row`), the weights and the banks.
        set, weights, banks: the structures, their present weights (structures,) and banks; views of `state`.
        plain: the model of a single structure that runs by the paper's Table 1, else None.
        least_speed: m/s, below which no course is stated.
        room: the estimate (9,), up to date where `is_current` is true.

    steerageway: of the profile, m/s. may_be_plain: whether Table 1 may be used, which excludes aids and lag.
    """

    def __init__(self, running: Set, steerageway: float, may_be_plain: bool):
        self._steerageway, self._may_be_plain = steerageway, may_be_plain
        self._arrange(running, None)

    def _arrange(self, running: Set, header: Floats | None) -> None:
        """Allocate the state of a set of structures."""
        self.set = running
        n = len(running.structures)
        groups = [(sizes, list(models)) for sizes, models in groupby(running.structures, lambda model: model.sizes)]
        space = [len(models) * bank_size(modes, states) for (modes, states, *_), models in groups]
        self.state = np.zeros(HEADER + n + sum(space))
        if header is not None:
            self.state[:HEADER] = header
        self.weights, memory = self.state[HEADER : HEADER + n], self.state[HEADER + n :]
        self.weights[:] = running.weights
        self._outs = np.full((n, FUSED + 3), np.nan)
        self.banks: list[Bank] = []
        self._groups: list[Alike] = []
        for ((modes, states, *_), models), size in zip(groups, space, strict=True):
            banks, memory = memory[:size].reshape(len(models), -1), memory[size:]
            outs = self._outs[len(self.banks) : len(self.banks) + len(models)]
            self._groups.append(Alike(banks, np.stack([packed(model) for model in models]), outs))
            self.banks += [bank_in(bank, modes, states) for bank in banks]
        may_be_plain = n == 1 and self._may_be_plain and not running.learns
        is_plain = may_be_plain and five_state.is_plain(running.structures[0], NO_AIDS)
        self.plain = self._groups[0].models[0] if is_plain else None
        self.room = np.full(POSITION_STD + 1, np.nan)
        weighed = [WeighedModel(*each) for each in zip(running.weights, running.structures, strict=True)]
        self.least_speed = least_course_speed(weighed, self._steerageway)
        self.is_current = False

    def __getstate__(self) -> dict[str, Any]:
        return {"made": (self._steerageway, self._may_be_plain), "own": self.snapshot()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._steerageway, self._may_be_plain = state["made"]
        snapshot = state["own"]
        self._arrange(snapshot[0], None)  # views, which copies and pickles would make arrays of their own
        self.restore(snapshot)

    @property
    def elapsed(self) -> float:
        """s since the first row."""
        return self.state.item(ELAPSED)

    def snapshot(self) -> tuple[Set, Floats]:
        """A copy of the whole state, with its structures, for `restore`."""
        return self.set, self.state.copy()

    def restore(self, snapshot: tuple[Set, Floats]) -> None:
        """Return to the state of a `snapshot`."""
        if snapshot[0] is not self.set:
            self._arrange(snapshot[0], None)
        self.state[:] = snapshot[1]
        for each in self._groups:
            read(each.banks, each.models, each.outs)
        self.is_current = False

    def advance(self, dt: float, first: float, second: float, excess: float, aids: Floats) -> None:
        """Advance by dt (s), then take a fix in the plane (m; NaN for none) and one row of aids, or no row.

        excess: factor on the usual variance of the fix.
        """
        self.is_current = False
        if dt > LONGEST_GAP:
            self.state[KNOWN] = 0.0
            for bank in self.banks:
                bank.run["started"] = 0
            dt = 0.0
        if self.set.fading:
            self._fade(dt)
        stepped = step if self.plain is None else step_plain
        for banks, models, outs in self._groups:
            stepped(banks, models, dt, first, second, excess, aids, outs)
        self.state[ELAPSED] += dt  # a new array if `_fade` has just dropped the older structures
        if self.set.learns and math.isfinite(first):
            self._learn()

    def _learn(self) -> None:
        logs = np.log(self.weights) + self._outs[:, LOG_DENSITY]
        logs = np.maximum(logs - logs.max(), LEAST_LOG_WEIGHT)
        weights = np.exp(logs)
        self.weights[:] = weights / weights.sum()

    def _fade(self, dt: float) -> None:
        """Shift weight to the newer structures, and drop the older ones at the end of FADE."""
        running, state = self.set, self.state
        state[FADED] += dt
        share = min(state[FADED] / FADE, 1.0)
        if share == 1.0:
            left, kept = self.banks[running.fading :], running.structures[running.fading :]
            newer = running.weights[running.fading :]
            self._arrange(Set(kept, newer, 0, (), False), state[:HEADER].copy())
            self._copy_banks(left)
            return
        self.weights[: running.fading] = (1.0 - share) * np.array(running.fading_weights)
        self.weights[running.fading :] = share * np.array(running.weights[running.fading :])

    def take_up(self, running: Set, banks: Sequence[Bank]) -> None:
        """Begin to blend to other structures; their banks have taken the fixes so far, in the same plane."""
        older, old, weights = self.set, self.banks, self.weights.copy()
        if self.plain is not None:  # Table 1 writes the upper triangle only
            old[0].p[:] = symmetric(old[0].p)
        n = len(older.structures)
        joined = Set(older.structures + running.structures, (0.0,) * n + running.weights, n, tuple(weights), False)
        self._arrange(joined, self.state[:HEADER].copy())
        self._copy_banks([*old, *banks])
        self.weights[:n], self.weights[n:] = weights, 0.0
        self.state[FADED] = 0.0

    def _copy_banks(self, banks: Sequence[Bank]) -> None:
        for bank, from_ in zip(self.banks, banks, strict=True):
            for part, other in zip(bank, from_, strict=True):
                part[...] = other

    def is_copy(self, latitude: float, longitude: float) -> bool:
        """Whether a fix repeats the one before, although the boat has moved by more than the resolution of fixes."""
        state = self.state
        if latitude != state[LATITUDE] or longitude != state[LONGITUDE] or not 0.0 < state[SINCE] <= HELD:
            return False
        return state[LAST_SOG] * state[SINCE] > FEW_STEPS * state[COARSE] > 0.0

    def weighed(self, column: int) -> float:
        """Weighted mean over the structures of a column of the last row, NIS or WRONG of `stream_row`."""
        return float(self.weights @ self._outs[:, column])

    def estimate(self) -> Floats:
        """The present estimate (9,) in the plane; columns: see `log.course`."""
        if not self.is_current:
            self._combine()
            doubt_slide(self.state, self.room)
            self.is_current = True
        return self.room

    def settle(self) -> Floats:
        """As `estimate`, once after every row: also notes the speed, and whether it is known (`stream_row.settle`)."""
        self._combine()
        settle(self.state, self.room)
        self.is_current = True
        return self.room

    def _combine(self) -> None:
        if self.plain is not None:
            read_plain(self.state, self.plain, self.least_speed, self.room)
        else:
            average(self._outs, self.weights, self.least_speed, self.room)

    def moments(self) -> tuple[Floats, Floats]:
        """State and covariance, see `motion_moments`."""
        return motion_moments(self.set.structures, self.banks, self.weights)

    def position_covariance(self) -> Floats:
        """(2, 2) covariance of the position north and east, m²."""
        azimuth = origin_of(self.state, self.estimate()).item(AZIMUTH)
        return covariance_from_north(self.moments()[1][:2, :2], azimuth)

    def gyro_bias(self) -> float:
        """Estimated bias of the yaw gyro, rad/s; NaN where a structure has no such state."""
        which = AIDS.index("yaw_rate")
        places = [int(each.aids["companion"][which]) for each in self.set.structures]
        if not all(places):
            return math.nan
        each = zip(self.weights, self.banks, places, strict=True)
        return float(sum(weight * bank.probability @ bank.x[:, place] for weight, bank, place in each))


def output_of(state: Floats, estimate: Floats, is_geodetic: bool) -> list[float]:
    """The output for an estimate (9,) in the plane: position (rad, or m in the plane), SOG, COG, course rate, 1σ of
    these three and of position. state: header that locates the plane, see `stream_row`."""
    place = place_of(state, estimate) if is_geodetic else (estimate.item(NORTH), estimate.item(EAST))
    if state[KNOWN] != 1.0:
        return [*place, *[math.nan] * 6, estimate.item(POSITION_STD)]
    return [*place, estimate.item(SOG), true_course(state, estimate), *estimate[RATE:].tolist()]


def motion_moments(models: Sequence[Model], banks: Sequence[Bank], weights: Floats) -> tuple[Floats, Floats]:
    """State [x^n y^n U χ ω_χ …] and covariance: (n,) and (n, n) of a single mode, (5,) and (5, 5) of a mixture.

    The course rate is the held one; NaN before the first fix.
    """
    n = banks[0].x.shape[1] if len(banks) == 1 and len(models[0].modes) == 1 else 5
    if not all(bank.run["started"][0] for bank in banks):
        return np.full(n, np.nan), np.full((n, n), np.nan)
    means = np.concatenate([bank.x[:, :n] for bank in banks])
    covariances = of_course(means, np.concatenate([bank.p[:, :n, :n] for bank in banks]))
    shares = np.concatenate([weight * bank.probability for weight, bank in zip(weights, banks, strict=True)])
    likeliest = means[np.argmax(shares)]
    apart = means - likeliest
    apart[:, COURSE] = wrap_array(apart[:, COURSE])
    share = shares / shares.sum()
    mean = share @ apart
    spread = np.einsum("k,ki,kj->ij", share, apart, apart) - np.outer(mean, mean)
    state = likeliest + mean
    state[COURSE] = wrap(state[COURSE])
    return state, np.einsum("k,kij->ij", share, covariances) + spread


def of_course(x: Floats, p: Floats) -> Floats:
    """Covariances of states x (m, n). The filter's p (m, n, n) has the velocity across in place of the course."""
    scale = np.ones_like(x)
    scale[:, COURSE] = 1.0 / np.maximum(x[:, SPEED], _LEAST_SPEED)
    return symmetric(p) * scale[:, :, None] * scale[:, None, :]

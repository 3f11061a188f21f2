"""InferredFilter: weighed structures as a filter, fix by fix, by the arithmetic of `estimate`.

Its whole state is one array, so that a snapshot is one copy. Rows between and ahead of fixes are predicted with another
filter that is given the snapshot.
"""

import math
from collections.abc import Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.checks import elapsed
from steerway.core.compiled import kernel
from steerway.core.records import NO_COURSE, OK, PREDICTED, REJECTED, STARTING
from steerway.estimation.course.motion.layout import LONGEST_GAP
from steerway.estimation.course.update.aids import AIDS, NO_AIDS, expect_aids
from steerway.estimation.course.update.reported_accuracy import variance_scale
from steerway.estimation.inference.course import COG, EAST, NORTH, POSITION_STD, RATE, SOG, SOG_STD, average
from steerway.estimation.inference.model import FUSED, Bank, Model, bank_in, bank_size, model_in, packed
from steerway.estimation.inference.place import MOMENTS, mixed, place_moments, rotated
from steerway.estimation.inference.plane import place_near, step_between
from steerway.estimation.inference.record import FEW_STEPS, HELD, LONG, TURNED
from steerway.estimation.inference.row import Row, state_row, take_row
from steerway.estimation.inference.structures import model_of
from steerway.estimation.inference.whole_log import UNKNOWN_SPEED
from steerway.estimation.profiles.inferred import InferredProfile

(
    LATITUDE,  # of the last fix, rad
    LONGITUDE,
    FIRST,  # … its place in the plane, m
    SECOND,
    AZIMUTH,  # … direction of the first axis of the plane there, rad east of north
    PLACED,  # 1 once there is one
    KNOWN,  # 1 once the speed is known
    USUAL,  # state of `variance_scale`
    USUAL_COUNT,
    ELAPSED,  # s since the first row
    FADED,  # s since another set of structures was taken up
    COARSE,  # least step between fixes, m
    SINCE,  # s since the last fix that was no copy
    LAST_SOG,
) = range(14)
"""State of the filter beside the banks."""
_HEADER = 14
FADE = 10.0
"""s in which the weight goes over from one set of structures to the next: a few fixes of a usual receiver. Chosen."""
LEAST_LOG_WEIGHT = -40.0
"""No structure whose weight is learned is ever excluded; a filter that is lost has lucky runs of fixes, though. Chosen:
e⁻⁴⁰ is 4·10⁻¹⁸, below the rounding of the sum of weights."""
NIS, WRONG, LOG_DENSITY = FUSED, FUSED + 1, FUSED + 2
"""Columns after those of `fuse`: the last two are the probability of an outlier and the density of the row."""


class Alike(NamedTuple):
    """Structures of one size, which one call steps: a bank and a model are a row of numbers each."""

    banks: Floats  # (structures, `bank_size`)
    models: Floats  # (structures, …), see `packed`
    outs: Floats  # (structures, FUSED + 3)

    def step(self, dt: float, first: float, second: float, excess: float, aids: Floats) -> None:
        """One row of all, as of the kernel `step`."""
        step(self.banks, self.models, dt, first, second, excess, aids, self.outs)


class Set(NamedTuple):
    """Structures that run together: those fading out first. `learns`: weights follow the likelihood, as of a prior."""

    structures: tuple[Model, ...]
    weights: tuple[float, ...]
    fading: int
    fading_weights: tuple[float, ...]
    learns: bool


def set_of(structures, learns: bool = False) -> Set:
    """The set of weighed structures."""
    models = tuple(model_of(each.parts, each.values) for each in structures)
    return Set(models, tuple(each.weight for each in structures), 0, (), learns)


class InferredFilter:
    """SOG, COG and course rate fix by fix, by a profile of structures; two filters share nothing.

    Args:
        profile: structures with their weights.
        aid: which of "sog", "cog", "heading", "water_speed", "yaw_rate" to take beside positions, where the structures
            have a part for it.
        learns: whether the weights follow the likelihood of the fixes, for structures of which none is known to hold.

    Raises InputError for an unknown aid.
    """

    def __init__(self, profile: InferredProfile, aid: tuple[str, ...] = (), learns: bool = False):
        expect_aids(aid)
        self.profile, self.aid = profile, tuple(aid)
        self._first = set_of(profile.weighed, learns)
        self._arrange(self._first, None)

    def _arrange(self, running: Set, header: Floats | None) -> None:
        """Make room for a set of structures."""
        self._set = running
        n = len(running.structures)
        groups = [(sizes, list(models)) for sizes, models in groupby(running.structures, _sizes)]
        space = [len(models) * bank_size(sizes.modes, sizes.states) for sizes, models in groups]
        self._state = np.zeros(_HEADER + n + sum(space))
        if header is not None:
            self._state[:_HEADER] = header
        self._weights, memory = self._state[_HEADER : _HEADER + n], self._state[_HEADER + n :]
        self._weights[:] = running.weights
        self._outs = np.full((n, FUSED + 3), np.nan)
        self._banks, self._groups = [], []
        for (sizes, models), size in zip(groups, space, strict=True):
            banks, memory = memory[:size].reshape(len(models), -1), memory[size:]
            outs = self._outs[len(self._banks) : len(self._banks) + len(models)]
            self._groups.append(Alike(banks, np.stack([packed(model) for model in models]), outs))
            self._banks += [bank_in(bank, sizes.modes, sizes.states) for bank in banks]
        self._estimate = np.full(POSITION_STD + 1, np.nan)

    def reset(self) -> None:
        """Return to the state before the first fix."""
        self._arrange(self._set, None)

    def snapshot(self) -> tuple[Set, Floats]:
        """The whole state, for `restore`, of this filter or another."""
        return self._set, self._state.copy()

    def restore(self, snapshot: tuple[Set, Floats]) -> None:
        """Return to the state of a `snapshot`."""
        if snapshot[0] is not self._set:
            self._arrange(snapshot[0], None)
        self._state[:] = snapshot[1]

    def change_receiver(self) -> None:
        """Fixes come from another receiver from now on: the usual accuracy of the last one does not apply to it."""
        self._state[USUAL] = self._state[USUAL_COUNT] = 0.0

    def predict(self, dt: float) -> None:
        """Advance by dt seconds, by none where a clock was set back. Raises InputError where dt is not finite."""
        self._advance(elapsed("dt", dt), math.nan, math.nan, 1.0, NO_AIDS)

    def row(
        self,
        dt: float,
        latitude: float = math.nan,
        longitude: float = math.nan,
        aids: Sequence[float] | Floats | None = None,
        position_std: float = math.nan,
    ) -> tuple[list[float], float, int]:
        """One row of `estimate`, streaming: advance by dt, then take the measurements of that time.

        Arguments and what is returned as of `FiveStateFilter.row`.
        """
        state, dt = self._state, elapsed("dt", dt)
        table = NO_AIDS
        if self.aid and aids is not None:
            table = np.array([[a if name in self.aid else math.nan for name, a in zip(AIDS, aids, strict=True)]])
        fixed = math.isfinite(latitude) and math.isfinite(longitude)
        state[SINCE] += dt
        if fixed and self._is_copy(latitude, longitude):
            fixed = False
        excess = variance_scale(state[USUAL : USUAL_COUNT + 1], position_std) if fixed else 1.0
        first = second = math.nan
        if fixed:
            if state[SINCE] > LONG:
                state[KNOWN] = 0.0
            state[SINCE] = 0.0
            first, second = _walk(state, latitude, longitude)
        self._advance(dt, first, second, excess, table)
        nis, wrong = (float(self._weights @ self._outs[:, column]) for column in (NIS, WRONG))
        return self._row(fixed, nis, wrong)

    def _is_copy(self, latitude, longitude):
        """Whether a fix is the one before once more, though the boat has moved on by steps that fixes resolve."""
        state = self._state
        if latitude != state[LATITUDE] or longitude != state[LONGITUDE] or not 0.0 < state[SINCE] <= HELD:
            return False
        return state[LAST_SOG] * state[SINCE] > FEW_STEPS * state[COARSE] > 0.0

    def _advance(self, dt, first, second, excess, aids):
        if dt > LONGEST_GAP:
            self._state[KNOWN] = 0.0
            for bank in self._banks:
                bank.run["started"] = 0
            dt = 0.0
        if self._set.fading:
            self._fade(dt)
        for each in self._groups:
            each.step(dt, first, second, excess, aids)
        self._state[ELAPSED] += dt  # another array where the older structures have just gone
        if self._set.learns and math.isfinite(first):
            self._learn()

    def _learn(self):
        logs = np.log(self._weights) + self._outs[:, LOG_DENSITY]
        logs = np.maximum(logs - logs.max(), LEAST_LOG_WEIGHT)
        weights = np.exp(logs)
        self._weights[:] = weights / weights.sum()

    def _fade(self, dt):
        """Let the weight go over to the newer structures."""
        running, state = self._set, self._state
        state[FADED] += dt
        share = min(state[FADED] / FADE, 1.0)
        if share == 1.0:
            left, kept = self._banks[running.fading :], running.structures[running.fading :]
            newer = running.weights[running.fading :]
            self._arrange(Set(kept, newer, 0, (), False), state[:_HEADER].copy())
            for bank, old in zip(self._banks, left, strict=True):
                for part, other in zip(bank, old, strict=True):
                    part[...] = other
            return
        self._weights[: running.fading] = (1.0 - share) * np.array(running.fading_weights)
        self._weights[running.fading :] = share * np.array(running.weights[running.fading :])

    def take_up(self, running: Set, banks: Sequence[Bank]) -> None:
        """Go over to other structures without a jump; their banks know the fixes so far in the plane of this filter."""
        older, old, weights = self._set, self._banks, self._weights.copy()
        n = len(older.structures)
        joined = Set(older.structures + running.structures, (0.0,) * n + running.weights, n, tuple(weights), False)
        self._arrange(joined, self._state[:_HEADER].copy())
        for bank, from_ in zip(self._banks, [*old, *banks], strict=True):
            for part, other in zip(bank, from_, strict=True):
                part[...] = other
        self._weights[:n], self._weights[n:] = weights, 0.0
        self._state[FADED] = 0.0

    def _row(self, fixed, nis, wrong):
        state, estimate = self._state, self._estimate
        average(self._outs, self._weights, self.profile.steerageway, estimate)
        state[LAST_SOG] = estimate[SOG]
        known = state[KNOWN] == 1.0 or estimate[SOG_STD] < UNKNOWN_SPEED
        state[KNOWN] = 1.0 if known else 0.0
        latitude, longitude = _place(state, estimate)
        if not known:
            unknown = [math.nan] * 6
            return [latitude, longitude, *unknown, float(estimate[POSITION_STD])], nis, STARTING
        cog = _true(state, estimate)
        if wrong > 0.5:
            status = REJECTED
        elif math.isnan(cog):
            status = NO_COURSE
        else:
            status = OK if fixed and not math.isnan(nis) else PREDICTED
        values = [latitude, longitude, float(estimate[SOG]), cog, *estimate[RATE:].tolist()]
        return values, nis, status

    @property
    def covariance(self) -> Floats:
        """(2, 2) covariance of the position north and east, m²."""
        moments = np.zeros((len(self._banks), MOMENTS))
        for bank, out in zip(self._banks, moments, strict=True):
            place_moments(bank, out)
        nn, ne, ee = rotated(mixed(moments, self._weights), self._state[AZIMUTH])
        return np.array([[nn, ne], [ne, ee]])


def _sizes(model):
    return model.sizes


@kernel
def step(banks, models, dt, first, second, excess, aids, outs):
    """One row (see `Row`) of structures of one size, as `run_record` does it; aids (1 or 0, a).

    Into `outs` (structures, FUSED + 3): `state_row`, NIS, WRONG and LOG_DENSITY.
    """
    for k in range(len(outs)):
        model, out = model_in(models[k]), outs[k]
        bank = bank_in(banks[k], len(model.modes), model.states)
        row = Row(dt, first, second, excess)
        taken = take_row(bank, model, row, aids[0] if len(aids) else models[k, :0])
        state_row(bank, model, out)
        out[NIS], out[WRONG], out[LOG_DENSITY] = taken.nis, taken.wrong, taken.log_density


@kernel
def _walk(state, latitude, longitude):
    """Go on to a fix in the plane; its place there (m)."""
    if state[PLACED] == 0.0:
        state[PLACED] = 1.0
    else:
        north, east, convergence = step_between(state[LATITUDE], state[LONGITUDE], latitude, longitude)
        c, s = math.cos(state[AZIMUTH]), math.sin(state[AZIMUTH])
        state[FIRST] += c * north + s * east
        state[SECOND] += c * east - s * north
        state[AZIMUTH] += convergence
        for way, other in ((abs(north), abs(east)), (abs(east), abs(north))):
            if way > TURNED * other and (way < state[COARSE] or state[COARSE] == 0.0):
                state[COARSE] = way
    state[LATITUDE], state[LONGITUDE] = latitude, longitude
    return state[FIRST], state[SECOND]


@kernel
def _place(state, estimate):
    """Latitude and longitude (rad) of an estimate."""
    ahead, aside = estimate[NORTH] - state[FIRST], estimate[EAST] - state[SECOND]
    return place_near(state[LATITUDE], state[LONGITUDE], state[AZIMUTH], ahead, aside)


def _true(state, estimate) -> float:
    """Course from true north."""
    cog = float(estimate[COG] + state[AZIMUTH])
    return (cog + math.pi) % (2.0 * math.pi) - math.pi

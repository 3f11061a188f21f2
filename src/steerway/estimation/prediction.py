"""`predict`: later positions of every vessel of a record, with covariances (motion prediction from AIS, P0 §1)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from steerway.core.arrays import Floats, Ints
from steerway.core.errors import InputError
from steerway.core.gaps import LONGEST_GAP
from steerway.core.records import Fixes, Record
from steerway.estimation.filter.forecast import forecasts as forecasts_by_numbers
from steerway.estimation.filter.voyages import forecasts
from steerway.estimation.log.plane import covariance_from_north
from steerway.estimation.log.run import Track
from steerway.estimation.log_estimate import AnyProfile, choose_profile
from steerway.estimation.vessel.aids import expect_aids
from steerway.estimation.vessel.profile import Profile

if TYPE_CHECKING:
    import polars as pl

LONGEST_HORIZON = 3600.0
"""s"""


@dataclass(frozen=True, eq=False, repr=False)
class Prediction(Record):
    """Predicted positions, one row for every vessel and horizon: arrays (n,). `mmsi` is None for your own boat."""

    time: Floats  # Unix UTC, of the predicted position
    latitude: Floats  # rad
    longitude: Floats  # rad, [−π, π)
    horizon: Floats  # s since the vessel's last report
    variance_north: Floats  # m²
    variance_east: Floats  # m²
    covariance: Floats  # of north and east, m²
    mmsi: Ints | None = None

    @property
    def ellipse(self) -> tuple[Floats, Floats, Floats]:
        """Half axes of the 95 % ellipse (m, the longer first), and direction of the longer one (rad from north)."""
        mean, half = 0.5 * (self.variance_north + self.variance_east), 0.5 * (self.variance_north - self.variance_east)
        spread = np.hypot(half, self.covariance)
        chi_square = -2.0 * np.log(0.05)  # two degrees of freedom, 95 %
        axes = (np.sqrt(chi_square * (mean + spread)), np.sqrt(chi_square * np.maximum(mean - spread, 0.0)))
        return *axes, 0.5 * np.arctan2(self.covariance, half)

    def to_frame(self) -> "pl.DataFrame":
        """A polars DataFrame: mmsi, time_s, horizon_s, lat_deg, lon_deg, deviations, correlation, the 95 % ellipse."""
        import polars as pl

        longer, shorter, direction = self.ellipse
        north, east = np.sqrt(self.variance_north), np.sqrt(self.variance_east)
        columns = {} if self.mmsi is None else {"mmsi": self.mmsi}
        return pl.DataFrame(
            columns
            | {
                "time_s": self.time,
                "horizon_s": self.horizon,
                "lat_deg": np.degrees(self.latitude),
                "lon_deg": np.degrees(self.longitude),
                "north_std_m": north,
                "east_std_m": east,
                "north_east_correlation": self.covariance / (north * east),
                "ellipse95_longer_m": longer,
                "ellipse95_shorter_m": shorter,
                "ellipse95_direction_deg": np.mod(np.degrees(direction), 180.0),
            }
        )


def predict(
    fixes: Fixes,
    horizons: float | Sequence[float] = 600.0,
    profile: AnyProfile = None,
    aid: tuple[str, ...] | None = None,
) -> Prediction:
    """Position and covariance of every vessel, `horizons` seconds after the end of the record.

    Vessels whose last report is older than `LONGEST_GAP` are left out.

    Args:
        fixes: reports up to now.
        horizons: more than 0 s and at most 3600 s.
        profile: as for `estimate`.
        aid: as for `estimate`; None uses the SOG and COG of AIS reports, and positions alone for other records.

    Raises InputError for a horizon out of range and as `estimate` does.
    """
    wanted = np.atleast_1d(np.asarray(horizons, float))
    wrong = wanted[~((wanted > 0.0) & (wanted <= LONGEST_HORIZON))]
    if len(wrong):
        raise InputError(f"horizon is {wrong[0]:g}, expected more than 0 and at most {LONGEST_HORIZON:g} s")
    aid = _aids_of(fixes, aid)
    profile = choose_profile(fixes, profile, aid)
    fixes = fixes.rows(fixes.has_position & np.isfinite(fixes.time))
    if len(fixes) == 0:
        raise InputError("the log has no position with a time, expected at least one")
    now = fixes.time.max()
    rows, vessels = [], []
    for mmsi, track in fixes.in_order().tracks():
        silent = now - track.time[-1]
        if silent > LONGEST_GAP:
            continue
        found = _ahead(profile, aid, track, None, silent + wanted)
        rows += [(now + horizon, *each) for horizon, each in zip(wanted, found, strict=True)]
        vessels += [mmsi] * len(wanted)
    return _prediction(np.array(rows, float), None if fixes.mmsi is None else np.array(vessels, np.int64))


def hindcast(
    track: Fixes,
    horizons: Sequence[float],
    spacing: float = 0.0,
    profile: AnyProfile = None,
    aid: tuple[str, ...] | None = None,
) -> tuple[Ints, Prediction]:
    """Predictions from earlier rows of the record of one vessel, each by the rows up to it.

    Args:
        track: rows with positions of one vessel, in order of time.
        horizons: s after each of the rows.
        spacing: least time between two of the rows, s.
        profile, aid: as for `predict`; for None, the profile that `estimate` uses for the whole record.

    Returns the rows (n,), and predictions: all horizons of the first row, then those of the next. Raises InputError as
    `estimate` does.
    """
    aid = _aids_of(track, aid)
    profile = choose_profile(track, profile, aid)
    rows: list[int] = []
    last = -np.inf
    for row, moment in enumerate(track.time):
        if moment - last >= spacing:
            rows, last = [*rows, row], moment
    found = _ahead(profile, aid, track, rows, np.asarray(horizons, float)) if rows else []
    times = (np.asarray(track.time)[rows][:, None] + np.asarray(horizons, float)).ravel()
    columns = np.column_stack([times, np.array(found, float).reshape(-1, 6)])
    mmsi = None if track.mmsi is None else np.full(len(columns), track.mmsi[0])
    return np.array(rows, int), _prediction(columns, mmsi)


def _prediction(table: Floats, mmsi: Ints | None) -> Prediction:
    """The prediction whose columns before `mmsi` are those of a table (n, 7)."""
    time, latitude, longitude, horizon, nn, ee, ne = table.reshape(-1, 7).T
    return Prediction(time, latitude, longitude, horizon, nn, ee, ne, mmsi)


def _aids_of(fixes: Fixes, aid: tuple[str, ...] | None) -> tuple[str, ...]:
    """The aids that `predict` uses. Raises InputError for an unknown one."""
    if aid is None:
        return ("sog", "cog") if fixes.mmsi is not None else ()
    expect_aids(aid)
    return aid


def _ahead(
    profile: Profile, aid: tuple[str, ...], fixes: Fixes, rows: list[int] | None, horizons: Floats
) -> list[tuple[float, float, float, float, float, float]]:
    """(latitude, longitude, horizon, Σ_NN, Σ_EE, Σ_NE) for all horizons of every row; for None, of the last row."""
    track = Track(fixes, aid, recognises=bool(profile.structures))
    if not profile.structures:
        model, on_average = (each.models(aid)[0].model for each in (profile, profile.on_average))
        moments = forecasts_by_numbers(track.record, model, on_average, horizons, rows)
    else:
        order = np.argsort(horizons)
        moments = forecasts(track, profile.structures, horizons[order], rows)
        moments[:, order] = moments.copy()
    found = []
    for row, of_row in zip([len(track.time) - 1] if rows is None else rows, moments, strict=True):
        for horizon, each in zip(horizons, of_row, strict=True):
            latitude, longitude, azimuth = track.place_of(row, each[0], each[1])
            in_plane = np.array([[each[2], each[3]], [each[3], each[4]]])
            (north, both), (_, east) = covariance_from_north(in_plane, azimuth).tolist()
            found.append((latitude, longitude, horizon, north, east, both))
    return found

"""Logs ready to be judged: fixes, positions in a plane, and the reference with its lag."""

import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl

import steerway
from steerway.core import ECCENTRICITY_SQUARED, SEMI_MAJOR_AXIS, wrap_array
from steerway_studies.unseen_logs.catalogue import RATE_COLUMN, KnownLog, PublicLog
from steerway_studies.unseen_logs.reference import VelocityReference, course_lag, rate_lag, velocity_lag

FOLDER = "STEERWAY_LOGS"
_HEADING_SPAN = 1.0  # s over which the heading is differenced for a rate


@dataclass(frozen=True, eq=False)
class JudgedLog:
    """A log ready to be judged. `places` are (n, 2) m north and east of the first fix, one row a fix."""

    log: PublicLog | KnownLog
    fixes: steerway.Fixes
    places: np.ndarray
    reference: VelocityReference


def _known(path: str) -> Path:
    """The path of a log in the folder of recorded logs."""
    return Path(os.environ["STEERWAY_DATA"]) / "data" / path


def path_of(log: PublicLog | KnownLog) -> Path | None:
    """Path of the log on this machine; None if it is not there."""
    if isinstance(log, KnownLog):
        path = _known(log.path) if os.environ.get("STEERWAY_DATA") else None
    else:
        named = os.environ.get(FOLDER)
        path = Path(named) / log.name / f"{log.name}.csv" if named else None
    return path if path is not None and path.is_file() else None


def opened(log: PublicLog | KnownLog) -> JudgedLog:
    """Read a log that is there. Raises InputError as `steerway.read` does."""
    path = path_of(log)
    known = isinstance(log, KnownLog)
    record = steerway.read(path, source=log.source if known else None)
    reference = _of_instruments(log, record) if known else _of_columns(path, log)
    fixes = record.rows(record.has_position)
    places = plane(fixes.latitude, fixes.longitude)
    reference = replace(reference, course_lag=course_lag(reference, fixes.time, places))
    lags = {
        "lag": velocity_lag(reference, fixes.time, places),
        "rate_lag": rate_lag(reference, fixes.time, places),
    }
    return JudgedLog(log, fixes, places, replace(reference, **lags))


def plane(latitude, longitude) -> np.ndarray:
    """(n, 2) north and east (m) of positions (rad), summed from fix to fix with the radii of curvature between them."""
    middle = 0.5 * (latitude[1:] + latitude[:-1])
    w = 1.0 - ECCENTRICITY_SQUARED * np.sin(middle) ** 2
    prime_vertical = SEMI_MAJOR_AXIS / np.sqrt(w)
    north = np.diff(latitude) * prime_vertical * (1.0 - ECCENTRICITY_SQUARED) / w
    east = wrap_array(np.diff(longitude)) * prime_vertical * np.cos(middle)
    return np.concatenate([np.zeros((1, 2)), np.cumsum(np.column_stack([north, east]), axis=0)])


def _of_columns(path, log) -> VelocityReference:
    """The reference from the columns ref_* of a table; the study's page lists their names."""
    table = pl.read_csv(path, infer_schema_length=None)
    _, once = np.unique(table["time_s"].to_numpy(), return_index=True)

    def column(name):
        unknown = np.full(len(table), np.nan)
        return (table[name].cast(pl.Float64).fill_null(np.nan).to_numpy() if name in table.columns else unknown)[once]

    time = column("time_s")
    rate = np.radians(column("ref_rate_dps"))
    heading = np.radians(column("ref_heading_deg"))
    if np.isfinite(heading).any():
        rate = heading_rate(time, heading)
    reference = VelocityReference(time, column("ref_sog_mps"), np.radians(column("ref_cog_deg")), rate)
    reference = replace(reference, own=not log.independent, lasting=log.lasting)
    return reference.believed(column("ref_sog_std_mps"))


def heading_rate(time, heading) -> np.ndarray:
    """(n,) mean rate of the heading over the second around each row, rad/s; NaN near the ends."""
    known = np.flatnonzero(np.isfinite(heading))
    lifted = np.unwrap(heading[known])
    ends = [np.interp(time + side * 0.5 * _HEADING_SPAN, time[known], lifted) for side in (-1.0, 1.0)]
    rate = (ends[1] - ends[0]) / _HEADING_SPAN
    outside = (time - time[known[0]] < _HEADING_SPAN) | (time[known[-1]] - time < _HEADING_SPAN)
    return np.where(outside, np.nan, rate)


def _of_instruments(log, record) -> VelocityReference:
    said = steerway.read(_known(log.truth)) if log.truth else record
    said = said.rows(np.isfinite(said.sog) | np.isfinite(said.cog))
    said = said.rows(np.unique(said.time, return_index=True)[1])
    rate = np.full(len(said), np.nan)
    if log.turns:
        table = pl.read_csv(_known(log.turns))
        rates = np.radians(table[RATE_COLUMN].to_numpy())
        rate = np.interp(said.time, table["t"].to_numpy(), rates, left=np.nan, right=np.nan)
    return VelocityReference(said.time, said.sog, said.cog, rate, own=not log.truth).believed()

"""The data of the interactive page, as one compressed block of columns that its script unpacks."""

import base64
import gzip
import json
import math
from typing import Any

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.earth import SEMI_MAJOR_AXIS, radii
from steerway.core.records import REJECTED, STATUSES, Fixes, Motion
from steerway.core.statistics import FIX_GATE
from steerway.report.drawing import on_axis, thinned

Column = tuple[np.ndarray, *tuple[Any, ...]]
"""A column: its values, the name of their code, and the numbers of this code."""
MOST_ROWS = 60_000
"""Largest number of rows drawn: two hours at 8 Hz. A longer log is thinned evenly."""


def mercator(latitude: np.ndarray, longitude: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Web Mercator coordinates x, y (m), in which map tiles are cut, of positions in rad, (n,) each.

    x is continuous; NaN where unknown.
    """
    known = np.isfinite(longitude)
    x = np.full(len(longitude), np.nan)
    x[known] = SEMI_MAJOR_AXIS * np.unwrap(longitude[known])
    return x, SEMI_MAJOR_AXIS * np.arctanh(np.sin(latitude))


def pack(fixes: Fixes, motion: Motion, cut: float, truth: Motion | None = None) -> dict[str, Any]:
    """The block: names, lengths and codes of the columns, and the base64 of their compressed bytes.

    Positions are relative to the first and times are steps, so single precision resolves 1 mm and 1 ms.
    Other columns are 16-bit integers: steps of their range or of their logarithm, each finer than a drawn line.
    """
    x, y = mercator(motion.latitude, motion.longitude)
    known = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    origin = (float(x[known[0]]), float(y[known[0]])) if len(known) else (0.0, 0.0)
    begins = float(motion.time[0])
    columns: dict[str, Column] = {
        "step": _single(_steps(motion.time, begins)),
        "x": _single(x - origin[0]),
        "y": _single(y - origin[1]),
        "sog": _linear(motion.sog),
        "sog_std": _logarithmic(motion.sog_std),
        "cog": _linear(on_axis(motion.cog, cut)),
        "cog_std": _logarithmic(np.degrees(motion.cog_std)),
        "rate": _linear(np.degrees(motion.course_rate)),
        "rate_std": _logarithmic(np.degrees(motion.course_rate_std)),
        "ratio": _logarithmic(np.sqrt(motion.nis / 2.0)),
        "position_std": _logarithmic(motion.position_std),
        "status": _linear(motion.status.astype(float)),
    }
    if truth is not None:
        true_x, true_y = mercator(truth.latitude, truth.longitude)
        columns |= {
            "true_x": _single(true_x - origin[0]),
            "true_y": _single(true_y - origin[1]),
            "true_sog": _linear(truth.sog),
            "true_cog": _linear(on_axis(truth.cog, cut)),
            "true_rate": _linear(np.degrees(truth.course_rate)),
        }
    placed = thinned(fixes.rows(fixes.has_position), MOST_ROWS)
    fix_x, fix_y = mercator(placed.latitude, placed.longitude)
    turns = (
        np.round((fix_x[0] - x[known[0]]) / (2.0 * math.pi * SEMI_MAJOR_AXIS)) if len(known) and len(placed) else 0.0
    )
    columns |= {
        "fix_step": _single(_steps(placed.time, begins)),
        "fix_x": _single(fix_x - origin[0] - turns * 2.0 * math.pi * SEMI_MAJOR_AXIS),
        "fix_y": _single(fix_y - origin[1]),
    }
    reported = thinned(fixes.rows(np.isfinite(fixes.sog) | np.isfinite(fixes.cog)), MOST_ROWS)
    columns |= {
        "reported_step": _single(_steps(reported.time, begins)),
        "reported_sog": _linear(reported.sog),
        "reported_cog": _linear(np.where(reported.sog > 0.3, on_axis(reported.cog, cut), np.nan)),
    }
    return {
        "columns": [[name, len(values), *code] for name, (values, *code) in columns.items()],
        "begins": begins,
        "origin": origin,
        "scale": _scale(float(motion.latitude[known[0]])) if len(known) else (1.0, 1.0),
        "cut": cut,
        "gate": math.sqrt(FIX_GATE / 2.0),
        "statuses": STATUSES,
        "rejected": REJECTED,
        "bytes": base64.b64encode(gzip.compress(b"".join(each[0].tobytes() for each in columns.values()), 6)).decode(),
    }


_UNKNOWN = 65535
_LEAST = 1e-6
_FINENESS = 4e-4
"""Resolution of the logarithm: 0.04 %, so that 16 bits reach from a millionth to 2e5."""


def _single(values: Floats) -> Column:
    return np.asarray(values, dtype="<f4"), "single"


def _linear(values: Floats) -> Column:
    """16-bit steps over the range of the values; the last step is NaN."""
    known = np.isfinite(values)
    low, high = (float(values[known].min()), float(values[known].max())) if known.any() else (0.0, 0.0)
    step = max((high - low) / (_UNKNOWN - 1), 1e-12)
    steps = np.where(known, np.round((values - low) / step), _UNKNOWN)
    return steps.astype("<u2"), "linear", low, step


def _logarithmic(values: Floats) -> Column:
    """16-bit steps of the logarithm of positive values; step 0 is a value below a millionth, the last step NaN."""
    known = np.isfinite(values)
    steps = np.round(np.log(np.where(known, np.maximum(values, _LEAST), 1.0) / _LEAST) / _FINENESS)
    return np.where(known, np.minimum(steps, _UNKNOWN - 1), _UNKNOWN).astype("<u2"), "logarithmic", _LEAST, _FINENESS


def script_json(value: object) -> str:
    """JSON that may stand inside a script element."""
    return json.dumps(value, allow_nan=False, ensure_ascii=False).replace("<", "\\u003c")


def _scale(latitude: float) -> tuple[float, float]:
    """Units of the projection (of a sphere) per metre east and north on the ellipsoid."""
    meridian, prime_vertical = radii(latitude)
    return SEMI_MAJOR_AXIS / (prime_vertical * math.cos(latitude)), SEMI_MAJOR_AXIS / (meridian * math.cos(latitude))


def _steps(time: Floats, begins: float) -> Floats:
    """Times as steps from one to the next; the errors of rounding do not add up."""
    return np.diff(np.round(time - begins, 3), prepend=0.0)

"""The command that summarizes the contents of logs: info."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from steerway.commands.options import AS_JSON, LOGS, MAX_SIZE, read_logs
from steerway.commands.terminal import flag, print_json, print_notes, print_pairs, print_table, progress_line
from steerway.core.errors import printable

if TYPE_CHECKING:
    from steerway.formats.reading import Log


def info(
    logs: list[str] = LOGS,
    models: bool = flag(
        "--models", "Infer models of vessel and receiver; print each with its weight and log evidence."
    ),
    max_size: float | None = MAX_SIZE,
    as_json: bool = AS_JSON,
) -> None:
    """Summarize log contents: sources, messages, rates, gaps, time span.

    Examples:

        steerway info sortie.nmea plotter.n2k

        steerway info sortie.nmea --models
    """
    from steerway.formats.reading import survey

    with progress_line("reading") as step:
        found = survey(*logs, progress=lambda done, total: step(done / total if total else 0.0), max_size=max_size)
    inferred = _models(logs, max_size) if models else {}
    if as_json:
        print_json([_log_as_dict(log) | ({"inferred": inferred} if models else {}) for log in found])
        return
    for log in found:
        _print_log(log)
    if models:
        print_pairs(
            [
                ("repeated positions", f"{inferred['repeated']} of {inferred['fixes']}"),
                ("extrapolated positions", f"{inferred['extrapolated']} of {inferred['fixes']}"),
                ("positions of another receiver", f"{inferred['of_other_receiver']} of {inferred['fixes']}"),
                (
                    "last digit",
                    f"{digit:.3g} m, coarse" if (digit := inferred["quantum"]) else "fine",
                ),
                ("time stamps", "irregular; even times used" if inferred["regular_times"] else "used as recorded"),
                *(
                    (f"weight {m['weight']:.2f}", f"log evidence {m['log_evidence']:.1f}: {m['words']}")
                    for m in inferred["models"]
                ),
            ]
        )


def _models(logs: Sequence[str], max_size: float | None) -> dict[str, Any]:
    """Numbers of fixes: all, repeated, extrapolated, of another receiver; their last digit (m); the inferred models."""
    import numpy as np

    from steerway.estimation.fit.description import structures_of
    from steerway.estimation.log.run import Track
    from steerway.estimation.log_estimate import LogEstimator

    fixes = read_logs(logs, None, None, None, max_size)
    placed = fixes.rows(fixes.has_position)
    same = (np.diff(placed.latitude) == 0.0) & (np.diff(placed.longitude) == 0.0)
    estimator = LogEstimator(fixes)
    tracks = [Track(each, ()) for _, each in placed.tracks()]
    used = estimator.profile
    found = structures_of(used, estimator.inference)
    return {
        "fixes": len(placed),
        "repeated": int(same.sum()),
        "extrapolated": sum(each.extrapolated for each in tracks),
        "of_other_receiver": sum(each.of_other_receiver for each in tracks),
        "quantum": max((max(each.record.quantum) for each in tracks), default=0.0),
        "regular_times": any(each.regular for each in tracks),
        "models": found,
    }


def _log_as_dict(log: "Log") -> dict[str, Any]:
    from dataclasses import asdict

    recording = log.recording
    return {
        "log": log.name,
        "format": recording.format,
        "sources": {name: asdict(quality) for name, quality in log.sources.items()},
        "counts": recording.counts,
        "skipped": recording.skipped,
        "notes": list(recording.notes),
    }


def _print_log(log: "Log") -> None:
    from steerway.core.timestamps import iso

    recording = log.recording
    columns = ("source", "fixes", "rate", "gaps", "longest", "last digit", "from", "until", "other data")
    rows = []
    for name, q in sorted(log.sources.items(), key=lambda each: -each[1].score):
        vessels = f" ({q.vessels} vessels)" if q.vessels else ""
        longest = f"{q.longest_gap:.1f} s" if q.gaps else "–"
        rate, resolution = _or_dash(q.rate, "{:.3g} Hz"), _or_dash(q.resolution, "{:.3g} m")
        span = [iso(round(time, 3)) if math.isfinite(time) else "–" for time in (q.start, q.stop)]
        rows.append((name, q.fixes, rate, q.gaps, longest, resolution, *span, ", ".join(q.says) + vessels))
    print_table(f"{log.name}: {recording.format}", columns, rows)
    for heading, counts in (("read", recording.counts), ("skipped", recording.skipped)):
        if counts:
            ordered = sorted(counts.items(), key=lambda each: -each[1])
            print(printable(f"  {heading}: " + ", ".join(f"{count} × {what}" for what, count in ordered)))
    print_notes(recording.notes, "  ")


def _or_dash(value: float, form: str) -> str:
    return form.format(value) if math.isfinite(value) else "–"

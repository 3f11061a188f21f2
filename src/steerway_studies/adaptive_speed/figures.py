"""The figures: 1–15 as the paper's captions name them, then what the paper does not show."""

import numpy as np
from matplotlib.figure import Figure

from steerway.core import NORMAL_95
from steerway_studies.adaptive_speed import cases, plants, printed, theory
from steerway_studies.adaptive_speed.comparisons import column
from steerway_studies.adaptive_speed.loop import sail
from steerway_studies.adaptive_speed.plants import SPEEDS

OURS, PRINTED, PUBLISHED, TRUTH, FAINT, LOG = "#0b6e99", "#c8553d", "#8a8d91", "#222222", "#bfc7cf", "#e0a458"


def all_figures(judged, tracks, seed) -> dict:
    """(figure, caption) by stem."""
    found = {}
    voyages = {speed: sail(plants.plant("a"), plants.controller("a"), ((0.0, speed),), seed) for speed in SPEEDS}
    kinds = (_response, _effort, _tracking_error, _parameters, _filter)
    number = 0
    for draw_one in kinds:
        for speed in SPEEDS:
            number += 1
            figure, stem, caption = draw_one(
                speed, voyages[speed], tracks["printed"][speed], tracks["published"][speed]
            )
            found[f"fig{number:02d}_{stem}_{speed}"] = figure, f"Figure {number}. {caption}"
    found["order_at_10_hz"] = _order()
    found["random_plants"] = _chance(judged)
    found["staircase"] = _staircase(seed)
    found["faults"] = _faults(seed)
    found["lyapunov"] = _lyapunov()
    found["heading"] = _heading()
    return found


def _axes(rows=1, height=4.0, title=""):
    figure = Figure(figsize=(8.0, height), layout="constrained")
    axes = figure.subplots(rows, 1, sharex=True)
    figure.suptitle(title, fontsize=10)
    for each in np.atleast_1d(axes):
        each.grid(True, color="#e6e9ec")
        each.spines[["top", "right"]].set_visible(False)
    return figure, axes


def _response(speed, ours, as_printed, as_published):
    figure, axes = _axes(title=f"set-point {speed} m/s")
    axes.axhspan(0.98 * speed, 1.02 * speed, color="#eef4f7", label="±2 % of the set-point")
    axes.axvline(40.0, color=FAINT, lw=1.0, ls="--", label="target: 40 s")
    axes.plot(as_published.time, as_published.speed, color=PUBLISHED, label="published curve (plant P, no adaptation)")
    axes.plot(as_printed.time, as_printed.speed, color=PRINTED, label="printed MRAC on plant T")
    axes.plot(ours.time, ours.speed, color=OURS, label="MRAC+ on plant T with 0.5 s of shaft lag, fused speed")
    axes.plot(ours.time, ours.model, color=TRUTH, lw=1.0, ls=":", label="reference model of MRAC+")
    axes.set(xlabel="time, s", ylabel="surge speed, m/s", xlim=(0.0, 120.0), ylim=(0.0, 1.12 * speed))
    axes.legend(loc="lower right", frameon=False)
    return figure, "surge_response", f"Surge response for a set-point of {speed} m/s."


def _effort(speed, ours, as_printed, as_published):
    figure, axes = _axes(title=f"set-point {speed} m/s")
    axes.axhline(17.5, color=FAINT, ls="--", lw=1.0, label="limit of the shaft")
    axes.plot(as_published.time, as_published.shaft, color=PUBLISHED, label="published curve (plant P, no adaptation)")
    axes.plot(as_printed.time, as_printed.shaft, color=PRINTED, label="printed MRAC on plant T")
    axes.plot(ours.time, ours.shaft, color=OURS, label="MRAC+ on plant T with 0.5 s of shaft lag")
    axes.set(xlabel="time, s", ylabel="shaft speed, rev/s", xlim=(0.0, 120.0), ylim=(0.0, 18.5))
    figure.legend(loc="outside lower center", ncols=2, frameon=False)
    return figure, "control_effort", f"Control effort for a set-point of {speed} m/s."


def _tracking_error(speed, ours, as_printed, as_published):
    figure, axes = _axes(title=f"set-point {speed} m/s")
    curves = (
        (as_published, PUBLISHED, "published curve"),
        (as_printed, PRINTED, "printed MRAC"),
        (ours, OURS, "MRAC+"),
    )
    for track, colour, label in curves:
        axes.plot(track.time, track.speed - track.model, color=colour, label=label)
    axes.set(xlabel="time, s", ylabel="z = u − u_m, m/s", xlim=(0.0, 120.0))
    axes.legend(loc="upper right", frameon=False)
    return figure, "tracking_error", f"Tracking error to each one's reference model for a set-point of {speed} m/s."


def _parameters(speed, ours, as_printed, _):
    figure, axes = _axes(rows=3, height=6.0, title=f"set-point {speed} m/s")
    names = ("â_s", "â_u", "â_u|u|")
    units = ("rev²/(s·m)", "rev²/(s·m)", "rev²/m²")
    for i, (each, name, unit) in enumerate(zip(axes, names, units, strict=True)):
        each.plot(as_printed.time, as_printed.parameters[:, i], color=PRINTED, label="printed MRAC")
        each.plot(ours.time, ours.parameters[:, i], color=OURS, label="MRAC+")
        each.set_ylabel(f"{name}, {unit}")
    axes[0].legend(loc="best", frameon=False)
    axes[-1].set(xlabel="time, s", xlim=(0.0, 200.0))
    return figure, "parameters", f"Parameters of the controllers for a set-point of {speed} m/s."


def _filter(speed, ours, as_printed, _):
    time, truth, estimate, _, _ = printed.filtered(as_printed, 0)
    drifting = printed.filtered(as_printed, 0, imu="integrated")[2]
    figure, (above, middle, below) = _axes(rows=3, height=8.5, title=f"set-point {speed} m/s")
    above.plot(ours.time, ours.gps, ".", ms=2.0, color=FAINT, label="GPS")
    above.plot(ours.time, ours.log, ".", ms=2.0, color=LOG, label="Doppler log")
    above.plot(ours.time, ours.estimate, color=OURS, lw=1.5, label="fused speed")
    above.plot(ours.time, ours.speed, color=TRUTH, lw=0.8, ls="--", label="truth")
    since = np.searchsorted(ours.time, 10.0)
    above.set(ylabel="surge speed, m/s", ylim=(0.97 * ours.speed[since], 1.05 * speed))
    above.legend(loc="lower right", frameon=False, markerscale=4.0)
    middle.plot(ours.time, ours.gps - ours.speed, ".", ms=2.0, color=FAINT, label="GPS")
    middle.plot(ours.time, ours.log - ours.speed, ".", ms=2.0, color=LOG, label="Doppler log")
    middle.plot(ours.time, ours.estimate - ours.speed, color=OURS, lw=1.2, label="fused speed")
    band = NORMAL_95 * ours.std
    middle.fill_between(ours.time, -band, band, color=OURS, alpha=0.15, lw=0.0, label="its 95 % band")
    middle.set(ylabel="error, m/s", ylim=(-0.012, 0.018))
    middle.legend(loc="upper right", frameon=False, ncols=4, markerscale=4.0)
    voices = (
        (time, drifting - truth, PUBLISHED, "printed filter, accelerometer integrated"),
        (time, estimate - truth, PRINTED, "printed filter, accelerometer as speed"),
        (ours.time, ours.estimate - ours.speed, OURS, "this work"),
    )
    for when, error, colour, label in voices:
        below.plot(*_largest_by_second(when, 100.0 / speed * error), color=colour, label=label)
    below.axhline(1.0, color=TRUTH, lw=1.0, ls="--", label="target: 1 %")
    below.set(
        xlabel="time, s",
        ylabel="largest |error|\nof a second, % of set-point",
        yscale="log",
        ylim=(1e-3, 1e5),
        xlim=(10.0, 100.0),
    )
    below.legend(loc="upper right", frameon=False, ncols=2)
    return figure, "filter", f"Sensors and filters for a set-point of {speed} m/s, 10 to 100 s."


def _largest_by_second(time, error):
    """(second, largest size of an error within it)."""
    rows = round(1.0 / (time[1] - time[0]))
    whole = len(error) // rows * rows
    return time[:whole:rows] + 0.5, np.abs(error[:whole]).reshape(-1, rows).max(axis=1)


def _order():
    figure, axes = _axes(rows=2, height=6.0)
    for each, speed in zip(axes, (6, 9), strict=True):
        for adapt_first, colour, label in ((False, PRINTED, "output first"), (True, OURS, "adaptation first")):
            track = printed.at_ten_hertz(speed, adapt_first)
            each.plot(track.time, track.speed, color=colour, label=label)
        each.axhline(speed, color=FAINT, lw=1.0)
        each.set_title(f"set-point {speed} m/s", loc="left", fontsize=10)
        each.set(ylabel="surge speed, m/s", xlim=(0.0, 120.0))
    axes[0].legend(loc="lower right", frameon=False)
    axes[-1].set_xlabel("time, s")
    return figure, "The printed law at 10 Hz without a limit on n, 6 and 9 m/s: the order within a step decides."


def _chance(judged):
    figure = Figure(figsize=(8.0, 4.0), layout="constrained")
    axes = figure.subplots()
    for speed, colour in zip(SPEEDS, (OURS, LOG, PRINTED), strict=True):
        settled, peak = (column(judged, key, "chance", speed) for key in ("settling_s", "peak_pct"))
        axes.plot(settled, peak, ".", color=colour, label=f"{speed} m/s")
    axes.axvline(40.0, color=FAINT, ls="--", lw=1.0)
    axes.axhline(4.0, color=FAINT, ls="--", lw=1.0)
    axes.grid(True, color="#e6e9ec")
    axes.spines[["top", "right"]].set_visible(False)
    axes.set(xlabel="settling, s", ylabel="peak after current and wind, %", ylim=(0.0, 4.4))
    axes.legend(frameon=False)
    return figure, "MRAC+ on random boats; dashed: the target. The boat's own speed over ground throughout."


def _staircase(seed):
    voyage = sail(plants.plant("a"), plants.controller("a"), cases.STAIRCASE, seed, duration=500.0)
    figure, (above, below) = _axes(rows=2, height=6.0)
    above.plot(voyage.time, voyage.setpoint, color=FAINT, lw=1.5, label="set-point")
    above.plot(voyage.time, voyage.speed, color=OURS, label="MRAC+")
    above.plot(voyage.time, voyage.model, color=TRUTH, ls=":", lw=1.2, label="reference model")
    above.set(ylabel="surge speed, m/s")
    above.legend(loc="upper right", frameon=False)
    below.plot(voyage.time, voyage.shaft, color=OURS)
    below.set(xlabel="time, s", ylabel="shaft speed, rev/s", ylim=(0.0, 18.0))
    return figure, "Staircase 3-6-9-6-3 m/s on plant T with 0.5 s of shaft lag; the log that identifies the boat."


def _faults(seed):
    names = {
        "dvl": "log +0.1 m/s",
        "dvl_ramp": "log ramp 0.005 m/s²",
        "gps": "GPS +0.3 m/s",
        "imu": "accelerometer +0.1 m/s²",
    }
    figure, axes = _axes(rows=4, height=8.0)
    for each, (name, title) in zip(axes, names.items(), strict=True):
        fault = cases.FAULTS[name], cases.FAULT_AT
        boat, control = plants.plant("a"), plants.controller("a")
        voyage = sail(boat, control, ((0.0, 3),), seed, duration=160.0, propeller=plants.NOMINAL, fault=fault)
        error = 100.0 * (voyage.estimate - voyage.speed) / 3.0
        each.axhspan(-1.0, 1.0, color="#eef4f7")
        each.axvline(cases.FAULT_AT, color=FAINT, ls="--", lw=1.0)
        each.plot(voyage.time, error, color=OURS)
        for event in voyage.events:
            each.axvline(event.time, color=PRINTED, lw=1.0)
            label = f" {event.instrument} {event.what}"
            each.annotate(label, (event.time, 0.95), xycoords=("data", "axes fraction"), color=PRINTED, va="top")
        each.set_title(title, loc="left", fontsize=10)
        each.set(ylabel="error, %", xlim=(90.0, 130.0))
        shown = np.abs(error[(voyage.time > 90.0) & (voyage.time < 130.0)]).max()
        each.set_ylim(-max(1.3, 1.1 * shown), max(1.3, 1.1 * shown))
    axes[-1].set_xlabel("time, s")
    return figure, "Faults at 3 m/s from 100 s on: error of the fused speed, and who is named. Shaded: ±1 %."


def _lyapunov():
    held, free = theory.descent(3.0, constant=True), theory.descent(3.0, constant=False)
    figure, axes = _axes(rows=2, height=6.0)
    for each, run, title in zip(axes, (held, free), ("constant g", "g(u, n) of Table II"), strict=True):
        each.plot(run.time, run.derivative, color=OURS, label="V̇ along the run")
        each.plot(run.time, run.claimed, color=PRINTED, ls="--", label="−d_m z², what (21) claims")
        each.axhline(0.0, color=FAINT, lw=1.0)
        each.set_title(title, loc="left", fontsize=10)
        each.set(ylabel="V̇, m²/s³", xlim=(0.0, 40.0))
    axes[0].legend(loc="lower right", frameon=False)
    axes[1].set_xlabel("time, s")
    axes[1].set_yscale("symlog", linthresh=1e-3)
    return figure, "Lyapunov's function (19) at 3 m/s: (21) holds for constant g only."


def _heading():
    figure, axes = _axes()
    for speed, colour in ((3, OURS), (6, PRINTED)):
        for heading_loop, style in ((True, "-"), (False, "--")):
            course = theory.sail_straight(speed, heading_loop)
            label = f"{speed} m/s, {'with' if heading_loop else 'without'} a heading loop"
            axes.plot(course.time, np.degrees(course.heading), style, color=colour, label=label)
    axes.set(xlabel="time, s", ylabel="heading, °", xlim=(0.0, 200.0), ylim=(-45.0, 45.0))
    axes.legend(loc="lower left", frameon=False)
    return figure, "Three degrees of freedom, from rest and 5° off north: without a heading loop the boat turns away."

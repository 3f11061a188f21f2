"""Closed loops: the example scenarios and their variants for a minute, thinned; the sentences of a run."""

import tempfile
from functools import cache
from pathlib import Path

import numpy as np

from steerway.simulation import load_scenario, parse_scenario, sail_scenario
from steerway.simulation.testing import COLUMNS, errors, write
from tests.reference_outputs.tables import case

EXAMPLES = Path(__file__).parents[3] / "examples"
KEPT = (
    "true_north", "true_east", "true_heading", "true_north_velocity", "true_east_velocity", "read_north", "read_east",
    "estimated_sog", "estimated_cog", "estimated_course_rate", "estimated_cog_std", "leg_target", "reference_angle",
    "yaw", "mode", "by_course",
)  # fmt: skip


def example(name, **changes):
    return load_scenario(EXAMPLES / f"{name}.toml").model_copy(update=changes)


def track(scenario, rows=60):
    return thinned(sail_scenario(scenario).run, rows)


def thinned(run, rows=60):
    """State, estimate and orders at so many rows."""
    chosen = np.linspace(0, len(run) - 1, rows).astype(int)
    found = {name: run[name][chosen] for name in KEPT}
    return found | {"time": run.time[chosen], "command": run.command[chosen], "state": run.state[chosen]}


@cache
def square():
    return sail_scenario(example("otter-square", duration=60.0))


@case("simulate_otter_square", atol=1e-8)  # m, m/s, rad: a loop with noise amplifies rounding
def otter_square():
    return thinned(square().run)


@case("simulate_numbers", atol=1e-8)
def of_a_run():
    return {name: np.nan if value is None else float(value) for name, value in square().numbers.items()}


for name, duration in {"otter-mission": 80.0, "mariner-route": 800.0, "station-keeping": 150.0}.items():
    case(f"simulate_{name.replace('-', '_')}")(
        lambda name=name, duration=duration: track(example(name, duration=duration))
    )


_ROUTE = """
[route]
acceptance = 4.0
at_end = "continue"
passing = "circle"
waypoints = [{ north = 0.0, east = 0.0 }, { north = 40.0, east = 0.0, speed = 1.0 }, { north = 40.0, east = 60.0 }]
"""


_SENSORS = "compass.bias_deg = 1.0\ngyro = {}\nlog.bias = 0.02\n"
VARIANTS = {
    "pure_pursuit_by_truth": 'estimator.kind = "truth"\nguidance.law = "pure-pursuit"\nreference.kind = "model"',
    "vector_field_in_weather": """
        guidance = { law = "vector-field", approach_deg = 60.0 }
        environment.wind = { speed = 6.0, gust_std = 1.0 }
        environment.waves = { displacement_std = 0.2, roll_std_deg = 2.0, drift = 5.0 }
        gnss = { latency = 0.2, faults = [{ kind = "dropout", start = 20.0, duration = 15.0 }] }
    """,
    "integral_by_heading": f'{_SENSORS}guidance.law = "integral-line-of-sight"\nenvironment.current.speed = 0.3',
    "adaptive_aided": f"""{_SENSORS}
        gnss.velocity_std = 0.1
        guidance.law = "adaptive-line-of-sight"
        estimator.aid = ["sog", "cog", "heading", "yaw_rate"]
    """,
}
for name, text in VARIANTS.items():
    case(f"simulate_{name}")(lambda text=text: track(parse_scenario(f"duration = 70.0\n{text}\n{_ROUTE}", "variant")))


@case("simulate_every_column")
def every_column():
    """One row in a hundred of everything that a run keeps, and the errors of the estimate."""
    run = sail_scenario(example("station-keeping", duration=40.0)).run
    found = {name: run[name][::100] for name in COLUMNS}
    return found | {f"error_{name}": values[::100] for name, values in errors(run).items()}


@case("simulate_sentences", text=True)
def sentences():
    """The receiver's sentences of a run, and what is written."""
    sailed = sail_scenario(example("otter-square", duration=12.0))
    with tempfile.TemporaryDirectory() as folder:
        written = write(sailed, Path(folder), nmea=True)
        texts = [path.read_text(encoding="utf-8") for path in written if path.suffix == ".nmea"]
    return "\n".join(sorted(path.name for path in written)) + "\n" + "".join(texts).replace("\r\n", "\n")

"""The command that prints the JSON Schemas of TOML files, with units; editors complete keys by them."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from steerway.commands.terminal import argument, option
from steerway.core.errors import InputError

if TYPE_CHECKING:
    from pydantic import BaseModel

KINDS = ("scenario", "profile", "settings", "mission")
_BY_ENDING = {"deg": "°", "dps": "°/s", "mps": "m/s", "m": "m", "s": "s", "hour": "°/h"}
_BY_KEY = {
    **dict.fromkeys(("duration", "step", "time_constant", "gust_time", "drift_time", "stay", "latency"), "s"),
    **dict.fromkeys(("propeller_lag", "yaw_time", "surge_time", "max_dead_reckoning", "start", "nomoto_time"), "s"),
    **dict.fromkeys(("slip_time", "operator_lost", "lag"), "s"),
    **dict.fromkeys(("speed", "cruise", "cruise_speed", "gust_std", "velocity_std"), "m/s"),
    **dict.fromkeys(("north", "east", "arm", "acceptance", "lookahead", "radius", "white", "lever_arm"), "m"),
    **dict.fromkeys(("payload_position", "displacement_std", "cross_track"), "m"),
    **dict.fromkeys(("corner_radius", "hold_radius", "length", "spacing", "run_in"), "m"),
    **dict.fromkeys(("bandwidth", "frequency"), "rad/s"),
    **dict.fromkeys(("force", "drift", "drift_std"), "N"),
    "markov": "m, s",
    "top_speed": "m/s",
    "rate_time": "s",
    "yaw_munk": "s²/m²",
    "yaw_quadratic": "s/rad",
    "moment": "N·m",
    "drag_area": "m²",
    "payload_mass": "kg",
    "rate": "Hz",
    "per_hour": "1/h",
    "damping": "1",
    "scale": "1",
    "dynamics": "1",
    "seed": "1",
    "integral_gain": "m/s",
    "adaptive_gain": "1/(m s)",
    "nomoto_gain": "rad/s for one unit of the autopilot's output",
    "gain": "1/s for a rad of rudder",
    "size": "m, or a factor: see the kind",
}
_SHAFT = {
    "shaft_limit": "rev/s",
    "shaft_lag": "s",
    "shaft_rate": "rev/s²",
    "diameter": "m",
    "guessed_drag": "1",
    "guessed_thrust": "1",
    "mass": "kg",
    "linear_drag": "N s/m",
    "quadratic_drag": "N s²/m²",
    "moment_limit": "N·m",
}
_OF_TABLE = {
    "CurrentTable": {"std": "m/s"},
    "LogTable": {"std": "m/s", "bias": "m/s"},
    "GyroTable": {"noise_density_deg": "°/√s", "turn_on_deg": "°/s", "in_run_deg_hour": "°/h"},
    "ReferenceTable": {"max_rate_deg": "°/s"},
    "BottomLogTable": {"std": "m/s", "bias": "m/s"},
    "AccelerometerTable": {
        "noise_density_micro_g": "µg/√Hz",
        "turn_on_milli_g": "mg",
        "in_run_micro_g": "µg",
        "leak_std": "m/s²",
        "leak_time": "s",
    },
    "TachometerTable": {"std": "rev/s"},
    "HeadingEstimatorTable": {"weight": "1"},
    "SpeedEstimatorTable": {"sog_std": "m/s", "bottom_std": "m/s", "water_std": "m/s", "scale_std": "1"},
    "SpringerTable": {"effectiveness": "1", "bias_rpm": "rev/min"},
    "EnvironmentTable": {"force_std": "N", "moment_std": "N·m", "force_time": "s"},
    "OrderTable": {"time": "s"},
    "PositioningEstimatorTable": {
        "position_std": "m",
        "force_std": "N, N, N·m",
        "force_time": "s",
        "wave_std": "m",
        "wave_frequency": "rad/s",
        "process_noise": "1",
    },
    "PositioningTable": {"integral": "1"},
    "LowSpeedTable": {"inertia": "kg, kg·m, kg·m²", "damping": "kg/s, kg·m/s, kg·m²/s"},
    "ThrusterTable": {"ahead": "m", "starboard": "m", "limit": "N", "limit_astern": "N"},
    "SurgeTable": _SHAFT,
    "CaldasTable": _SHAFT,
}
"""Units of keys that mean something else in one table."""


def schema_of(kind: str) -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of a kind of file, of `KINDS`. Numbers have a `unit`."""
    if kind not in KINDS:
        raise InputError(f"schema {kind!r} is unknown, expected one of {', '.join(KINDS)}")
    model = _model(kind)
    found = model.model_json_schema(by_alias=True)
    for name, table in {model.__name__: found, **found.get("$defs", {})}.items():
        for key, value in table.get("properties", {}).items():
            if _is_number(value):
                value.setdefault("unit", unit_of(name, key))
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": f"Steerway {kind}"} | found


def _model(kind: str) -> "type[BaseModel]":
    if kind == "scenario":
        from steerway.simulation.scenario import Scenario

        return Scenario
    if kind == "profile":
        from steerway.estimation.vessel.profile import Profile

        return Profile
    if kind == "settings":
        from steerway.live.settings import Settings

        return Settings
    from steerway.live.autopilot.mission import MissionFile

    return MissionFile


def unit_of(table: str, key: str) -> str:
    """The unit of a number in a table; "" where none is known."""
    if key in _OF_TABLE.get(table, {}):
        return _OF_TABLE[table][key]
    return _BY_ENDING.get(key.rsplit("_", 1)[-1], "") if "_" in key and key not in _BY_KEY else _BY_KEY.get(key, "")


def _is_number(schema: dict[str, Any]) -> bool:
    text = json.dumps({key: value for key, value in schema.items() if key != "default"})
    return '"number"' in text or '"integer"' in text


def schema(
    kind: str = argument("KIND", f"The kind of file: {', '.join(KINDS)}."),
    out: Path | None = option("FILE", "Output file, .json.", None, "-o", "--out"),
) -> None:
    """Print the JSON Schema of scenarios, profiles, settings or missions, by which editors complete their keys.

    An editor with TOML support finds it by the first line of a file: #:schema scenario.json

    Example:

        steerway schema scenario -o scenario.json
    """
    text = json.dumps(schema_of(kind), ensure_ascii=False, indent=2) + "\n"
    if out is None:
        print(text, end="")
        return
    from steerway.core.files import complete_or_absent

    with complete_or_absent(out) as file:
        file.write(text.encode())
    print(f"wrote {out}")

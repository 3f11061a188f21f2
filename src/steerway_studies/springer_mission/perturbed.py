"""The aided filter in perturbed worlds, with nothing known: neither first heading nor speed nor current.

Every scene is world (a), whose propellers are off and whose compass is anywhere in the box, with one thing more: any
first heading, a strong current, another speed through the water, a circuit turned and mirrored, a deviation card,
compasses outside the box, another plant, late GNSS, longer and shorter steps. Waypoints are steered for by the heading
that makes the course good in the estimated current.
"""

import math
from dataclasses import replace

import numpy as np

from steerway.sensors import TCM2
from steerway.vessels import SPRINGER_SPEED as SPEED
from steerway_studies.springer_mission.missions import MissionResult, real_world
from steerway_studies.springer_mission.navigators import all_round
from steerway_studies.springer_mission.world import PAPER_CIRCUIT, MissionTrack, sail

DIRECTIONS_DEG = (0, 45, 90, 135, 180, 225, 270, 315)


def _in_current(share):
    def scene(seed, world, rng):
        towards = rng.uniform(0.0, 2.0 * math.pi)
        return {"world": replace(world, current=(share * SPEED * math.cos(towards), share * SPEED * math.sin(towards)))}

    return scene


def _water_speed(seed, world, rng):
    return {"world": replace(world, speed=SPEED * (0.9 if seed % 2 else 1.1))}


def _turned(seed, world, rng):
    angle = rng.uniform(0.0, 2.0 * math.pi)
    c, s = math.cos(angle), math.sin(angle)
    circuit = (PAPER_CIRCUIT * (1.0, -1.0 if seed % 2 else 1.0)) @ np.array([[c, s], [-s, c]])
    return {"circuit": circuit, "heading": angle}


def _card(scale):
    def scene(seed, world, rng):
        card = rng.standard_normal(5) * (1.0, 3.0, 3.0, 1.0, 0.5)
        return {"world": replace(world, card=tuple(np.radians(scale * card).tolist()))}

    return scene


def _compass(factor):
    return lambda seed, world, rng: {"world": replace(world, compass=TCM2.scaled(factor))}


def _plant(factor):
    """The boat's yaw moment, on top of what is off in world (a)."""
    return lambda seed, world, rng: {"world": replace(world, effectiveness=factor * world.effectiveness)}


def _late(seed, world, rng):
    return {"world": replace(world, lag=1)}


def _step(step):
    return lambda seed, world, rng: {"step": step}


def _first_heading(heading_deg):
    return lambda seed, world, rng: {"heading": math.radians(heading_deg)}


SCENES = {
    **{f"start_{each}": _first_heading(each) for each in DIRECTIONS_DEG},
    "current_20": _in_current(0.2),
    "current_30": _in_current(0.3),
    "current_50": _in_current(0.5),
    "water_speed_off": _water_speed,
    "turned": _turned,
    "card_1": _card(1.0),
    "card_3": _card(3.0),
    "compass_098": _compass(0.98),
    "compass_1012": _compass(1.012),
    "plant_098": _plant(0.98),
    "plant_1012": _plant(1.012),
    "gnss_late": _late,
    "step_05": _step(0.5),
    "step_2": _step(2.0),
}
LABELS = {
    "current_20": "current of 20 % of the boat's speed, any direction",
    "current_30": "current of 30 %",
    "current_50": "current of 50 %",
    "water_speed_off": "water speed 10 % off",
    "turned": "circuit turned, half of them mirrored",
    "card_1": "deviation card",
    "card_3": "deviation card × 3",
    "compass_098": "compass × 0.98, outside the box",
    "compass_1012": "compass × 1.012, outside the box",
    "plant_098": "plant × 0.98",
    "plant_1012": "plant × 1.012",
    "gnss_late": "GNSS velocity 1 s late",
    "step_05": "steps of 0.5 s",
    "step_2": "steps of 2 s",
}


def voyage(name: str, seed: int) -> MissionTrack:
    """One mission in a scene."""
    given = {"world": real_world("a", seed)}
    given |= SCENES[name](seed, given["world"], np.random.default_rng((seed, 16)))
    return sail(navigator=all_round(), seed=seed, **given)


def missions(seed: int) -> dict[str, MissionResult]:
    """Every scene with one seed."""
    return {name: MissionResult.of(voyage(name, seed)) for name in SCENES}


def compare(results, table) -> None:
    """Shares of missions that reach all waypoints, and median heading errors."""

    def share(names):
        return 100.0 * float(np.mean([each.all for name in names for each in table[name]]))

    starts = [name for name in SCENES if name.startswith("start_")]
    value = share(starts)
    what = f"nothing known, {len(starts)} first headings: all reached"
    results.compare("any_start_reached_pct", value, what, "%", "", "≥ 95", value >= 95.0)
    for name, label in LABELS.items():
        value, judged = share([name]), name in ("current_20", "current_30", "current_50", "water_speed_off")
        what = f"nothing known, {label}: all reached"
        target = ("≥ 95", value >= 95.0) if judged else ("", None)
        results.compare(f"{name}_reached_pct", value, what, "%", "", *target)
    for name in SCENES:
        median = float(np.median([each.heading_median_deg for each in table[name]]))
        results.numbers[f"{name}_heading_median_deg"] = median
    results.numbers["any_start_heading_median_deg"] = float(
        np.median([each.heading_median_deg for name in starts for each in table[name]])
    )

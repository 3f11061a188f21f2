"""An inference in words: structures, weights, evidence and the numbers that matter."""

import math

from steerway.estimation.course.update.aids import TABLE
from steerway.estimation.inference.selection import Inference
from steerway.estimation.profiles.inferred import InferredProfile

_WORDS = {
    "base": "fixes with {fix_std:.2g} m of noise",
    "wander": "speed varying by {speed_std:.2g} m/s and course rate by {wander_std:.2g}°/s",
    "calm_rate": "course rate within {rate_std:.2g}°/s on a held course",
    "waves": "waves: {wave_surge:.2g} m/s every {surge_period:.2g} s, {wave_yaw:.2g}°/s every {yaw_period:.2g} s",
    "strokes": "surge {stroke_surge:.2g} m/s every {stroke_period:.2g} s",
    "antenna": "antenna rolling {antenna_std:.2g} m every {antenna_period:.2g} s",
    "clock": "time of a fix within {time_std:.2g} s",
    "beat": "beat of two clocks, {beat_std:.2g} s every {beat_period:.2g} s",
    "error": "error of {error_std:.2g} m over {error_time:.2g} s",
    "second_roll": "antenna rolling {roll_std:.2g} m every {roll_period:.2g} s too",
    "quick_error": "error of {quick_std:.2g} m over {quick_time:.2g} s",
    "steps": "steps of {step_std:.2g} m every {step_every:.2g} s",
    "obstructions": "noise larger by {obstructed_noise:.2g} times the usual for {obstructed_time:.2g} s at a time",
    "slips": "steps of {slip_std:.2g} s along the way",
    **{aid.name: aid.words for aid in TABLE},
}
_ANGLES = ("wander_std", "rate_std", "wave_yaw", *(aid.noise for aid in TABLE if "°" in aid.words))


def structures_of(profile: InferredProfile, inference: Inference | None = None) -> list[dict]:
    """Of every structure, best first: parts, weight, log_evidence (NaN of one not fitted), values, words.

    With an inference also of those that competed and have no weight.
    """
    fits = inference.fits if inference else ()
    evidence = {fit.parts: fit.evidence for fit in fits}
    models: dict = {fit.parts: (0.0, fit.values) for fit in fits}
    for each in profile.structures:  # of a short record there are several sets of numbers to the same parts
        weight, values = models.get(each.parts, (0.0, each.values))
        models[each.parts] = weight + each.weight, values
    found = [
        {
            "parts": list(parts),
            "weight": weight,
            "log_evidence": evidence.get(parts, math.nan),
            "values": values,
            "words": in_words(parts, values),
        }
        for parts, (weight, values) in models.items()
    ]
    return sorted(found, key=lambda each: (-each["weight"], -each["log_evidence"]))


def in_words(parts, values) -> str:
    """What a structure says of vessel and receiver."""
    shown = {name: math.degrees(value) if name in _ANGLES else value for name, value in values.items()}
    return "; ".join(_WORDS[part].format(**shown) for part in parts)

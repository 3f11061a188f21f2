"""An inference in words: structures, weights, evidence and the numbers that matter."""

import math

from steerway.estimation.course.update.aids import TABLE
from steerway.estimation.inference.parts import PARTS
from steerway.estimation.inference.selection import Inference
from steerway.estimation.profiles.inferred import InferredProfile

_ANGLES = ("wander_std", "wave_yaw", *(aid.noise for aid in TABLE if "°" in aid.words))


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
    return "; ".join(PARTS[part].words.format(**shown) for part in parts)

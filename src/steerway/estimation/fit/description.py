"""Inferences and tuned profiles in words: structures, weights, evidence and main numbers."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from steerway.estimation.fit.selection import Inference
from steerway.estimation.vessel.aids import TABLE
from steerway.estimation.vessel.parts import PARTS, Parts, Values
from steerway.estimation.vessel.profile import Profile

_ANGLES = ("wander_std", "wave_yaw", *(aid.noise for aid in TABLE if "°" in aid.words))


@dataclass(frozen=True)
class Tuned:
    """A profile fitted to a log, and how well a fit without the last fixes predicts these fixes."""

    profile: Profile
    default: Profile
    """The profile that `estimate` infers from the same fixes."""
    fixes: int
    moving: int
    rejected: int
    nis_mean: float
    """Mean NIS of all fixes; 2 if the noise is as inferred and no fix is an outlier."""
    nis_within_pct: float
    """Share (%) of fixes within the predicted 95 % region."""
    held_back: int
    held_back_log_likelihood: float
    default_held_back_log_likelihood: float
    at_bounds: tuple[str, ...]
    """Numbers that ended at the bounds of the search."""

    @property
    def is_default(self) -> bool:
        """Whether more effort found no profile that predicts better than the default."""
        return self.held_back_log_likelihood <= self.default_held_back_log_likelihood

    @property
    def cannot_tell(self) -> tuple[str, ...]:
        """Names of the numbers that this log does not determine: see `Structure.is_determined`."""
        return tuple(
            dict.fromkeys(
                name for each in self.profile.structures for name in each.values if not each.is_determined(name)
            )
        )

    def as_dict(self) -> dict[str, Any]:
        """The fields as plain numbers, texts and lists; `structures` as in the profile."""
        names = ("fixes", "moving", "rejected", "nis_mean", "nis_within_pct", "held_back", "held_back_log_likelihood")
        own = {name: getattr(self, name) for name in (*names, "default_held_back_log_likelihood", "is_default")}
        structures = [each.model_dump(mode="json") for each in self.profile.structures]
        lists = {"at_bounds": list(self.at_bounds), "cannot_tell": list(self.cannot_tell)}
        return own | lists | {"structures": structures}

    def sentences(self) -> list[tuple[str, str]]:
        """The fit as (what, value) pairs of text."""
        gain = self.held_back_log_likelihood - self.default_held_back_log_likelihood
        if self.is_default:
            result = "no better than what estimate infers without a profile: you do not need this one"
        else:
            result = f"predicts the {self.held_back} fixes held back better than the default does"
        return [
            ("result", result),
            *([] if self.is_default else [("log likelihood", f"{gain:.1f} above the default's on these fixes")]),
            ("NIS", f"{self.nis_mean:.2f} (2 expected), {self.nis_within_pct:.1f} % of fixes in the predicted 95 %"),
            ("estimate", "causal: every fix is predicted from the fixes before it"),
            ("fixes", f"{self.fixes}, {self.moving} under way, {self.rejected} rejected"),
            *((f"weight {each['weight']:.2f}", each["words"]) for each in structures_of(self.profile)),
            *([("at a limit of the search", ", ".join(self.at_bounds))] if self.at_bounds else []),
            *(
                [("not determined", f"{', '.join(self.cannot_tell)}: this log does not determine them")]
                if self.cannot_tell
                else []
            ),
        ]


def structures_of(profile: Profile, inference: Inference | None = None) -> list[dict[str, Any]]:
    """Every structure as a dict, best first: parts, weight, log_evidence (NaN if not fitted), values, words.

    With an inference, structures that were fitted but have no weight are included.
    """
    fits = inference.fits if inference else ()
    evidence = {fit.parts: fit.evidence for fit in fits}
    models: dict[Parts, tuple[float, Values]] = {fit.parts: (0.0, fit.values) for fit in fits}
    for each in profile.structures:  # a short record has several sets of numbers for the same parts
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


def is_of_hull(structures: Iterable[dict[str, Any]]) -> bool:
    """Whether the estimated motion is the hull's: structures with a rolling antenna have at least half of the weight.

    Otherwise it is the antenna's motion. structures: see `structures_of`.
    """
    return sum(each["weight"] for each in structures if "antenna" in each["parts"]) >= 0.5


def in_words(parts: Parts, values: Values) -> str:
    """The parts of a structure and their main numbers as one text."""
    shown = {name: math.degrees(value) if name in _ANGLES else value for name, value in values.items()}
    return "; ".join(PARTS[part].words.format(**shown) for part in parts)

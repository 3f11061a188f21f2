"""An inference or a tuned profile in words: structures, weights, evidence and the numbers that matter."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from steerway.estimation.fit.selection import Inference
from steerway.estimation.vessel.aids import TABLE
from steerway.estimation.vessel.inferred import InferredProfile
from steerway.estimation.vessel.parts import PARTS, Parts, Values

_ANGLES = ("wander_std", "wave_yaw", *(aid.noise for aid in TABLE if "°" in aid.words))


@dataclass(frozen=True)
class Tuned:
    """A profile fitted to a log, and how well what was found in the rest predicts the fixes that were held back."""

    profile: InferredProfile
    default: InferredProfile
    """What `estimate` finds by itself in the same fixes."""
    fixes: int
    moving: int
    rejected: int
    nis_mean: float
    """Over all fixes; 2 where noise is as inferred and no fix is wrong."""
    nis_within_pct: float
    """Share of fixes within the predicted 95 % region."""
    held_back: int
    held_back_log_likelihood: float
    default_held_back_log_likelihood: float
    at_bounds: tuple[str, ...]
    """Numbers that ended at the bounds of the search."""

    @property
    def is_default(self) -> bool:
        """Whether more effort found nothing that predicts better than the default."""
        return self.held_back_log_likelihood <= self.default_held_back_log_likelihood

    @property
    def cannot_tell(self) -> tuple[str, ...]:
        """Names of the numbers that this log does not determine: see `InferredProfile`."""
        return tuple(
            dict.fromkeys(
                name for each in self.profile.structures for name in each.values if not each.is_determined(name)
            )
        )

    def as_dict(self) -> dict[str, Any]:
        """All as plain numbers, texts and lists; `structures` as in the profile."""
        names = ("fixes", "moving", "rejected", "nis_mean", "nis_within_pct", "held_back", "held_back_log_likelihood")
        own = {name: getattr(self, name) for name in (*names, "default_held_back_log_likelihood", "is_default")}
        structures = [each.model_dump(mode="json") for each in self.profile.structures]
        lists = {"at_bounds": list(self.at_bounds), "cannot_tell": list(self.cannot_tell)}
        return own | lists | {"structures": structures}

    def sentences(self) -> list[tuple[str, str]]:
        """The fit as (what, value) pairs of text."""
        gain = self.held_back_log_likelihood - self.default_held_back_log_likelihood
        if self.is_default:
            result = "no improvement on what estimate finds by itself: you do not need this profile"
        else:
            result = f"predicts {self.held_back} fixes that were held back better than the default does"
        return [
            ("result", result),
            *([] if self.is_default else [("log likelihood", f"{gain:.1f} above the default's on these fixes")]),
            ("NIS", f"{self.nis_mean:.2f} (2 expected), {self.nis_within_pct:.1f} % of fixes in the predicted 95 %"),
            ("estimate", "causal: every fix is predicted from those before it"),
            ("fixes", f"{self.fixes}, {self.moving} under way, {self.rejected} rejected"),
            *((f"weight {each['weight']:.2f}", each["words"]) for each in structures_of(self.profile)),
            *([("at a limit of the search", ", ".join(self.at_bounds))] if self.at_bounds else []),
            *(
                [("at prior values", f"{', '.join(self.cannot_tell)}: the log does not determine these")]
                if self.cannot_tell
                else []
            ),
        ]


def structures_of(profile: InferredProfile, inference: Inference | None = None) -> list[dict[str, Any]]:
    """What every structure is, best first: parts, weight, log_evidence (NaN of one not fitted), values, words.

    With an inference also of those that competed and have no weight.
    """
    fits = inference.fits if inference else ()
    evidence = {fit.parts: fit.evidence for fit in fits}
    models: dict[Parts, tuple[float, Values]] = {fit.parts: (0.0, fit.values) for fit in fits}
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


def is_of_hull(structures: Iterable[dict[str, Any]]) -> bool:
    """Whether the motion by these (see `structures_of`) is that of the hull under an antenna that rolls.

    Otherwise it is the antenna's.
    """
    return sum(each["weight"] for each in structures if "antenna" in each["parts"]) >= 0.5


def in_words(parts: Parts, values: Values) -> str:
    """What a structure says of vessel and receiver."""
    shown = {name: math.degrees(value) if name in _ANGLES else value for name, value in values.items()}
    return "; ".join(PARTS[part].words.format(**shown) for part in parts)

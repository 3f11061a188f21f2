"""Inferred profiles: structures of vessel and receiver with their weights and numbers, in a TOML file."""

import logging
import math
from collections.abc import Iterable
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from steerway.core.settings import parse_toml, positive_number, read_toml, toml_value
from steerway.estimation.fit.selection import Structure
from steerway.estimation.log.course import STEERAGEWAY
from steerway.estimation.vessel.parts import PARTS, PLAIN, Parts, Values
from steerway.estimation.vessel.profile import Profile, ProfileFile
from steerway.estimation.vessel.structures import VESSELS, parameters_of

LOG = logging.getLogger("steerway")
REMOVED = {
    "strokes": ("stroke_surge", "stroke_period", "stroke_damping"),
    "beat": ("beat_std", "beat_period", "beat_damping"),
    "quick_error": ("quick_std", "quick_time"),
    "slips": ("slip_std",),
}
"""Parts of earlier versions, and their numbers. They are left out when a file that names them is read."""
WIDEST_INTERVAL = 10.0
"""Ratio of the ends of a 95 % interval above which a number is not determined, not even its order of magnitude."""
_NOISES = tuple(0.025 * 2.0 ** (0.5 * k) for k in range(17))
"""White noise (m) of the prior's receivers, equally probable: from RTK to a receiver under trees, in factors of √2.
With factors of 2, an Otter's SOG errs up to 1.7 times as much, because fixes look like emergencies if the noise is set
to 0.8 of its value. With factors of 4, it errs 2.4 times as much."""
_SUM = 1e-6
"""Largest error of the sum of weights, which may be written by hand with six digits."""


class WeighedStructure(BaseModel):
    """One structure: weight, parts, numbers by name, and 95 % intervals of numbers that were fitted to a log."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    weight: float = positive_number()
    parts: Parts
    values: Values
    intervals: dict[str, tuple[float, float]] = Field(default_factory=dict)
    quantum: tuple[float, float] = (0.0, 0.0)
    """Last digit of a fix north and east, m; 0 where fixes are not rounded."""

    @field_validator("parts")
    @classmethod
    def _declared(cls, parts: Parts) -> Parts:
        for part in parts:
            if part not in PARTS:
                raise ValueError(f"part {part!r} is unknown, expected some of {', '.join(PARTS)}")
        if "base" not in parts:
            raise ValueError("part 'base' is missing, expected in every structure")
        return parts

    @model_validator(mode="after")
    def _whole(self) -> Self:
        names, _, _ = parameters_of(self.parts)
        for name in names:
            if name not in self.values:
                raise ValueError(f"values has no {name}, which the parts {', '.join(self.parts)} need")
        if not all(0.0 <= digit < math.inf for digit in self.quantum):
            raise ValueError(f"quantum is {list(self.quantum)}, expected two numbers of 0 or more (m)")
        for name, value in self.values.items():
            if name not in names:
                raise ValueError(f"values has {name}, which none of the parts {', '.join(self.parts)} takes")
            if not 0.0 < value < float("inf"):
                raise ValueError(f"{name} is {value}, expected a positive number")
        return self

    def is_determined(self, name: str) -> bool:
        """Whether the log of the tuning determines this number; True for a number without an interval."""
        low, high = self.intervals.get(name, (1.0, 1.0))
        return high <= WIDEST_INTERVAL * low


class InferredProfile(ProfileFile):
    """The structures inferred for a vessel and its receiver, each a bank of modes, with their weights."""

    name: str = "inferred"
    steerageway: float = positive_number(STEERAGEWAY)
    """Speed, m/s, below which no course is output."""
    structures: tuple[WeighedStructure, ...] = Field(min_length=1)

    recognises: ClassVar[bool] = True
    """Whether a record is searched for copies of fixes, extrapolated ones and those of another receiver."""

    @model_validator(mode="after")
    def _shared_out(self) -> Self:
        total = sum(each.weight for each in self.structures)
        if abs(total - 1.0) > _SUM:
            raise ValueError(f"the weights of the structures add up to {total:g}, expected 1")
        return self

    @classmethod
    def of(cls, structures: Iterable[Structure], name: str = "inferred") -> Self:
        """The profile of weighted structures (see `fit.selection`)."""
        return cls(name=name, structures=tuple(WeighedStructure(**each._asdict()) for each in structures))

    @property
    def weighed(self) -> tuple[Structure, ...]:
        """The structures as the estimators use them."""
        return tuple(Structure(each.weight, each.parts, each.values, each.quantum) for each in self.structures)

    def models(self, aid: tuple[str, ...] = (), smoothed: bool = False) -> tuple[Structure, ...]:
        """The structures that filters and smoothers run, each with its weight and its model."""
        return self.weighed

    @property
    def agility(self) -> float:
        """Spectral density of the course-rate noise in a yaw manoeuvre, rad²/s³, mean over the structures."""
        return sum(each.weight * each.values["yaw_size"] ** 2 / each.values["yaw_time"] for each in self.structures)

    @property
    def position_std(self) -> float:
        """White noise of a fix, m, mean over the structures."""
        return sum(each.weight * each.values["fix_std"] for each in self.structures)

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """An inferred profile from a TOML file. Raises InputError naming the file and the key that is wrong."""
        place = f"profile {path}"
        return cls.made_of(_of_this_version(read_toml(path, "profile"), place), place)

    def toml(self) -> str:
        text = "".join(f"{key} = {toml_value(getattr(self, key))}\n" for key in ("name", "description", "steerageway"))
        return text + "".join(map(_structure_toml, self.structures))


@cache
def prior_profile(aid: tuple[str, ...] = ()) -> InferredProfile:
    """The prior before the first fix: vessels and receivers of every declared kind, equally probable.

    aid: measurements beside positions; the structures get a part for each, with prior medians.
    """
    parts = (*PLAIN, *aid)
    names, medians, _ = parameters_of(parts)
    expected = dict(zip(names, np.exp(medians).tolist(), strict=True))
    kinds = [expected | vessel | {"fix_std": noise} for vessel, noise in product(VESSELS, _NOISES)]
    known = [{name: each[name] for name in names} for each in kinds]
    return InferredProfile.of([Structure(1.0 / len(kinds), parts, each) for each in known], "prior")


def load_profile(path: str | Path) -> Profile | InferredProfile:
    """The profile in a TOML file, of either kind: inferred ones have structures. Raises InputError."""
    place = f"profile {path}"
    return _of_either_kind(_of_this_version(read_toml(path, "profile"), place), place)


def parse_profile(text: str, place: str) -> Profile | InferredProfile:
    """The profile in a TOML text, of either kind; `place` names it in errors. Raises InputError, also for REMOVED."""
    return _of_either_kind(parse_toml(text, place), place)


def _of_this_version(table: dict[str, Any], place: str) -> dict[str, Any]:
    """A profile's table without REMOVED parts; a warning names them."""
    structures = _list(table.get("structures"))
    tables = [each for each in structures if isinstance(each, dict)]
    removed = [part for part in REMOVED if any(part in _list(each.get("parts")) for each in tables)]
    if not removed:
        return table
    LOG.warning("%s: read without %s, which this version does not have", place, ", ".join(removed))
    return table | {"structures": [_without(each, removed) if each in tables else each for each in structures]}


def _without(structure: dict[str, Any], removed: list[str]) -> dict[str, Any]:
    """The table of a structure without these parts and their numbers."""
    kept = {key: value for key, value in structure.items() if not isinstance(value, dict)}
    kept["parts"] = [part for part in _list(structure.get("parts")) if part not in removed]
    numbers = {name for part in removed for name in REMOVED[part]}
    tables = {key: value for key, value in structure.items() if isinstance(value, dict)}
    return kept | {key: {name: each[name] for name in each if name not in numbers} for key, each in tables.items()}


def _list(given: object) -> list[Any]:
    return given if isinstance(given, list) else []


def _of_either_kind(table: dict[str, Any], place: str) -> Profile | InferredProfile:
    return (InferredProfile if "structures" in table else Profile).made_of(table, place)


def profile_of(given: Profile | InferredProfile | str | Path | None) -> Profile | InferredProfile:
    """The profile given as such, by a built-in name or by a .toml file; the prior for None.

    Raises InputError for an unknown name.
    """
    if given is None:
        return prior_profile()
    if isinstance(given, Profile | InferredProfile):
        return given
    return load_profile(given) if str(given).endswith(".toml") else Profile.named(str(given))


def _structure_toml(structure: WeighedStructure) -> str:
    text = f"\n[[structures]]\nweight = {structure.weight!r}\nparts = {toml_value(structure.parts)}\n"
    if any(structure.quantum):
        text += f"quantum = {toml_value(structure.quantum)}  # m, last digit of a fix north and east\n"
    text += "\n[structures.values]  # SI, angles in rad\n"
    for name, value in structure.values.items():
        text += f"{name} = {value!r}{_comment(structure, name)}\n"
    if structure.intervals:
        text += "\n[structures.intervals]  # 95 %, from the log that it was tuned on\n"
        text += "".join(f"{name} = [{low!r}, {high!r}]\n" for name, (low, high) in structure.intervals.items())
    return text


def _comment(structure: WeighedStructure, name: str) -> str:
    if name not in structure.intervals:
        return ""
    words = "" if structure.is_determined(name) else "not determined by this log: "
    return "  # {}{:.3g} to {:.3g}".format(words, *structure.intervals[name])

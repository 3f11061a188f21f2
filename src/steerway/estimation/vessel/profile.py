"""Profiles: the vessel and its receiver as named, validated numbers in a TOML file.

A file lists structures with their weights, as an inference finds them. One structure of one or two modes may be written
shorter, as flat keys (`flat.Numbers`).
"""

import logging
from collections.abc import Iterable
from functools import cache
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import (
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)

from steerway.core.errors import InputError
from steerway.core.files import complete_or_absent
from steerway.core.settings import Table, read_toml, toml_value
from steerway.estimation.vessel.flat import Numbers, Weighed, WeighedModel, model_of_profile
from steerway.estimation.vessel.parts import PLAIN
from steerway.estimation.vessel.presets import PRESETS
from steerway.estimation.vessel.structures import VESSELS, Structure, medians_of

LOG = logging.getLogger("steerway")
REMOVED = {
    "strokes": ("stroke_surge", "stroke_period", "stroke_damping"),
    "beat": ("beat_std", "beat_period", "beat_damping"),
    "quick_error": ("quick_std", "quick_time"),
    "slips": ("slip_std",),
}
"""Parts of earlier versions, and their numbers. They are left out when a file that names them is read."""
_NOISES = tuple(0.025 * 2.0 ** (0.5 * k) for k in range(17))
"""White noise (m) of the prior's receivers, equally probable: from RTK to a receiver under trees, in factors of √2.
With factors of 2, an Otter's SOG errs up to 1.7 times as much, because fixes look like emergencies if the noise is set
to 0.8 of its value. With factors of 4, it errs 2.4 times as much."""
_SUM = 1e-6
"""Largest error of the sum of weights, which may be written by hand with six digits."""
_REQUIRED = ("speed_noise", "course_rate_noise", "position_std")
"""Keys without a default, in a file without structures."""
_OF_BOTH = ("name", "description", "steerageway")
"""Keys of files with and without structures."""


def _either_form(schema: dict[str, Any]) -> None:
    """Let the JSON Schema require the keys of one form of a profile."""
    keys = schema["properties"]
    for each in _REQUIRED:
        del keys[each]["default"]
    schema["properties"] = {each: keys.pop(each) for each in ("name", "description", "structures")} | keys
    schema["anyOf"] = [{"required": list(_REQUIRED)}, {"required": ["structures"]}]


class Profile(Numbers, Table):
    """Model of the motion of a vessel and of the errors of its receiver.

    A profile has one of two forms. Either flat keys give one structure, and the first two noises and position_std are
    required. Or `structures` lists several, each a bank of modes with a weight. Then steerageway is the only flat one,
    and position_std is the mean over the structures.
    """

    model_config = ConfigDict(json_schema_extra=_either_form)

    name: str = "custom"
    """Name of the profile."""
    description: str = ""
    """Description of the profile."""
    structures: tuple[Structure, ...] = ()
    """Structures of vessel and receiver that run side by side, as inferred from a log."""
    intervals: Annotated[dict[str, tuple[float, float]], "SI"] = Field(default_factory=dict)
    """95 % intervals by name, in files of earlier versions."""

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        flat = [each for each in type(self).model_fields if each in self.model_fields_set and each not in _OF_BOTH]
        if not self.structures:
            missing = next((each for each in _REQUIRED if each not in flat), None)
            if missing is not None:
                raise ValueError(f"{missing} is missing, expected {type(self).model_fields[missing].description}")
            return self
        flat.remove("structures")
        if flat:
            raise ValueError(f"structures and {flat[0]} are both given, expected one of them")
        total = sum(each.weight for each in self.structures)
        if abs(total - 1.0) > _SUM:
            raise ValueError(f"the weights of the structures add up to {total:g}, expected 1")
        self.__dict__["position_std"] = sum(each.weight * each.values["fix_std"] for each in self.structures)
        return self

    @model_serializer(mode="wrap")
    def _in_its_form(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """The keys of a file of this profile, the name first."""
        found = handler(self)
        left_out = Numbers.model_fields.keys() | {"intervals"} if self.structures else {"structures"}
        keys = dict.fromkeys((*_OF_BOTH[:2], *found))
        return {key: found[key] for key in keys if key in found and (key in _OF_BOTH or key not in left_out)}

    @classmethod
    def named(cls, name: str) -> "Profile":
        """A built-in profile. Raises InputError, with the built-in names, for another one."""
        if name not in BUILT_IN:
            raise InputError(f"profile {name!r} is unknown, expected one of {', '.join(BUILT_IN)} or a .toml file")
        return BUILT_IN[name]

    @classmethod
    def of(cls, structures: Iterable[Structure], name: str = "inferred") -> Self:
        """The profile of weighted structures (see `fit.selection`)."""
        return cls(name=name, structures=tuple(structures))

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """A profile from a TOML file. Raises InputError naming the file and the key that is wrong."""
        place = f"profile {path}"
        return cls.made_of(_of_this_version(read_toml(path, "profile"), place), place)

    def save(self, path: str | Path) -> None:
        """Write the profile as a TOML file that `load` reads."""
        with complete_or_absent(path) as file:
            file.write(self.toml().encode())

    def toml(self) -> str:
        """The profile as the text of a TOML file."""
        keys = self.model_dump(exclude={"structures", "intervals"}).items()
        text = "".join(f"{key} = {toml_value(value)}\n" for key, value in keys)
        text += "".join(map(_structure_toml, self.structures))
        return text + _intervals_toml("intervals", self.intervals)

    def models(self, aid: tuple[str, ...] = (), smoothed: bool = False) -> tuple[Weighed, ...]:
        """Weights and models that filters (or smoothers) run: of the structures, or of the flat numbers with the states
        that these aids need."""
        return self.structures or (WeighedModel(1.0, model_of_profile(self, aid, smoothed)),)

    @property
    def agility(self) -> float:
        """Spectral density of the course-rate noise in a turn, rad²/s³; for structures in a yaw manoeuvre, the mean."""
        if self.structures:
            return sum(each.weight * each.values["yaw_size"] ** 2 / each.values["yaw_time"] for each in self.structures)
        return super().agility


BUILT_IN = {profile.name: profile for profile in map(Profile.model_validate, PRESETS)}
"""The built-in profiles by name."""
InferredProfile, load_profile = Profile, Profile.load
"""Earlier names."""


@cache
def prior_profile(aid: tuple[str, ...] = ()) -> Profile:
    """The prior before the first fix: vessels and receivers of every declared kind, equally probable.

    aid: measurements beside positions; the structures get a part for each, with prior medians.
    """
    parts = (*PLAIN, *aid)
    expected = medians_of(parts)
    kinds = [expected | vessel | {"fix_std": noise} for vessel, noise in product(VESSELS, _NOISES)]
    known = [{name: each[name] for name in expected} for each in kinds]
    return Profile.of([Structure(weight=1.0 / len(kinds), parts=parts, values=each) for each in known], "prior")


def profile_of(given: Profile | str | Path | None) -> Profile:
    """The profile given as such, by a built-in name or by a .toml file; the prior for None.

    Raises InputError for an unknown name.
    """
    if given is None:
        return prior_profile()
    if isinstance(given, Profile):
        return given
    return Profile.load(given) if str(given).endswith(".toml") else Profile.named(str(given))


def _of_this_version(table: dict[str, Any], place: str) -> dict[str, Any]:
    """A profile's table without REMOVED parts; a warning names them."""
    structures = _list(table.get("structures"))
    tables = [each for each in structures if isinstance(each, dict)]
    removed = [part for part in REMOVED if any(part in _list(each.get("parts")) for each in tables)]
    if not removed:
        return table
    LOG.warning("%s: without the parts %s, which this version no longer has", place, ", ".join(removed))
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


def _structure_toml(structure: Structure) -> str:
    text = f"\n[[structures]]\nweight = {structure.weight!r}\nparts = {toml_value(structure.parts)}\n"
    if any(structure.quantum):
        text += f"quantum = {toml_value(structure.quantum)}  # m, last digit of a fix north and east\n"
    text += "\n[structures.values]  # SI, angles in rad\n"
    for name, value in structure.values.items():
        text += f"{name} = {value!r}{_comment(structure, name)}\n"
    return text + _intervals_toml("structures.intervals", structure.intervals)


def _intervals_toml(title: str, intervals: dict[str, tuple[float, float]]) -> str:
    if not intervals:
        return ""
    text = f"\n[{title}]  # 95 %, from the log that it was tuned on\n"
    return text + "".join(f"{name} = [{low!r}, {high!r}]\n" for name, (low, high) in intervals.items())


def _comment(structure: Structure, name: str) -> str:
    if name not in structure.intervals:
        return ""
    words = "" if structure.is_determined(name) else "not determined by this log: "
    return "  # {}{:.3g} to {:.3g}".format(words, *structure.intervals[name])

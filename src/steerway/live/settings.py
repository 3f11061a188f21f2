"""The settings of `steerway live` as one TOML file, checked before anything runs.

Keys are the command's options, with `_` for `-`; options on the command line override the file. File names in the file
are relative to its folder.
"""

from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field

from steerway.core.settings import Flag, NotNegative, Positive, Rate, Table, read_toml
from steerway.estimation.estimator_tables import HeadingEstimatorTable, SpeedEstimatorTable
from steerway.estimation.vessel.aids import AIDS
from steerway.live.uri import DEFAULT


def _several(value: Any) -> Any:
    """A single text becomes a tuple of one."""
    return (value,) if isinstance(value, str) else value


def _page(value: Any) -> Any:
    """`true` is the default address, `false` none."""
    return {True: DEFAULT, False: None}[value] if isinstance(value, bool) else value


Texts = Annotated[tuple[str, ...], BeforeValidator(_several)]
Aid = Literal["auto", *(name.replace("_", "-") for name in AIDS)]  # type: ignore[valid-type]
LONGEST_LAG = 60.0
"""Longest `lag`, s. Every fix smooths all waiting rows again, so that its processor time grows with the lag."""
FILES = ("mission", "record", "helm_token_file", "mavlink_signing", "control_token_file", "learned")
"""Keys that name a file."""


class SpeedSettings(Table):
    """How the autopilot holds a speed: PI, adaptive, or a disturbance observer, as in scenarios."""

    controller: Literal["pi", "adaptive", "disturbance-observer"] = "pi"


class AutopilotSettings(Table):
    """How the autopilot holds a course: pole placement, model predictive control or LQG, as in scenarios."""

    kind: Literal["pole-placement", "mpc", "lqg"] = "pole-placement"


class EstimatorSettings(Table):
    """Estimators beside the course filter, as in scenarios."""

    heading: HeadingEstimatorTable = HeadingEstimatorTable()
    speed: SpeedEstimatorTable = SpeedEstimatorTable()


class Settings(Table):
    """The options of `steerway live`; its help describes them."""

    inputs: Texts = Field(default=(), alias="from")
    outputs: Texts = Field(default=("stdout:",), alias="to", min_length=1)
    profile: str | None = None
    learned: str | None = None
    source: Texts = ()
    aid: Annotated[tuple[Aid, ...], BeforeValidator(_several)] = ("auto",)  # type: ignore[valid-type]
    rate: Annotated[Rate | None, "Hz"] = None
    mission: str | None = None
    record: str | None = None
    engage: Flag = False
    from_here: Flag = False
    max_dead_reckoning: Annotated[Positive, "s"] = 10.0
    latency: Annotated[NotNegative, "s"] = 0.0
    lag: Annotated[float, Field(strict=True, ge=0.0, le=LONGEST_LAG), "s"] = 0.0
    accuracy: Flag = True
    helm: Annotated[str | None, BeforeValidator(_page)] = None
    helm_token_file: str | None = None
    helm_origin: str | None = None
    missions: str | None = None
    mavlink_signing: str | None = None
    control: str | None = None
    control_token_file: str | None = None
    speed: SpeedSettings = SpeedSettings()
    autopilot: AutopilotSettings = AutopilotSettings()
    estimator: EstimatorSettings = EstimatorSettings()

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Settings from a TOML file. Raises InputError that names file, key, value and what was expected."""
        return cls.made_of(read_toml(path, "settings"), f"settings {path}")._relative_to(Path(path).parent)

    def overridden(self, **given: Any) -> Self:
        """A copy with the given values, except those that are None."""
        return self.model_copy(update={name: value for name, value in given.items() if value is not None})

    def _relative_to(self, folder: Path) -> Self:
        """A copy with relative file names made relative to `folder`."""
        files = {name: getattr(self, name) for name in FILES}
        if self.profile is not None and self.profile.endswith(".toml"):
            files["profile"] = self.profile
        found: dict[str, Any] = {name: str(folder / path) for name, path in files.items() if path is not None}
        found |= {name: tuple(_placed(each, folder) for each in getattr(self, name)) for name in ("inputs", "outputs")}
        return self.model_copy(update=found)


def _placed(address: str, folder: Path) -> str:
    scheme, colon, path = address.partition(":")
    return f"file:{folder / path}" if scheme == "file" and colon else address

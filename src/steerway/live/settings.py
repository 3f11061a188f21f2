"""The settings of `steerway live`: options of the command and keys of a TOML file, checked before anything runs.

Options on the command line override the file. File names in the file are relative to its folder.
"""

from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field

from steerway.core.records import AID_COLUMNS
from steerway.core.settings import Flag, NotNegative, Option, Positive, Rate, Table, names_of, read_toml
from steerway.estimation.estimator_tables import EstimatorSettings
from steerway.live.uri import DEFAULT


def _several(value: Any) -> Any:
    """A single text becomes a tuple of one."""
    return (value,) if isinstance(value, str) else value


def _page(value: Any) -> Any:
    """`true` is the default address, `false` none."""
    return {True: DEFAULT, False: None}[value] if isinstance(value, bool) else value


Texts = Annotated[tuple[str, ...], BeforeValidator(_several)]
Aid = Literal["auto", *(name.replace("_", "-") for name in AID_COLUMNS)]  # type: ignore[valid-type]
LONGEST_LAG = 60.0
"""Longest `lag`, s. Every fix smooths all waiting rows again, so that its processor time grows with the lag."""
FILES = ("mission", "record", "helm_token_file", "mavlink_signing", "control_token_file", "learned")
"""Keys that name a file."""


class SpeedSettings(Table):
    """How the autopilot holds a speed: PI, adaptive, or a disturbance observer, as in scenarios."""

    controller: Literal["pi", "adaptive", "disturbance-observer"] = "pi"
    """Speed controller."""


class AutopilotSettings(Table):
    """How the autopilot holds a course: pole placement, model predictive control or LQG, as in scenarios."""

    kind: Literal["pole-placement", "mpc", "lqg"] = "pole-placement"
    """Pole placement, model predictive control or LQG."""


class Settings(Table):
    """What `steerway live` does. A field with an `Option` is also an option of the command."""

    inputs: Annotated[Texts, Option("ADDRESS")] = Field(default=(), alias="from")
    """Where fixes come from."""
    outputs: Annotated[Texts, Option("ADDRESS")] = Field(default=("stdout:",), alias="to", min_length=1)
    """Where estimates go; stdout: by default."""
    profile: Annotated[str | None, Option("NAME|FILE.toml")] = None
    """Filter profile; by default inferred while sailing."""
    learned: Annotated[str | None, Option("FILE.toml")] = None
    """Save the inferred models to this file; the next run starts from them."""
    source: Annotated[Texts, Option("NAME")] = ()
    """Source of positions; can be repeated, the preferred one first."""
    aid: Annotated[tuple[Aid, ...], BeforeValidator(_several), Option("LIST")] = ("auto",)  # type: ignore[valid-type]
    """Further measurements to use, any of: auto (default), sog, cog, heading, water-speed, yaw-rate."""
    rate: Annotated[Rate | None, "Hz", Option("HZ")] = None
    """Output rate in Hz; by default one row per fix."""
    mission: Annotated[str | None, Option("FILE")] = None
    """A route (.toml .gpx .geojson) to steer along."""
    record: Annotated[str | None, Option("FILE.mcap")] = None
    """Record every input, estimate and order."""
    max_dead_reckoning: Annotated[Positive, "s", Option("S")] = 10.0
    """Longest prediction without a fix, s; 10 by default."""
    engage: Annotated[Flag, Option()] = False
    """Start the autopilot as soon as it is ready."""
    from_here: Annotated[Flag, Option()] = False
    """Start the route even if its first leg is more than 2 km away."""
    latency: Annotated[NotNegative, "s", Option("S")] = 0.0
    """Shortest latency of the receiver's fixes, s."""
    lag: Annotated[float, Field(strict=True, ge=0.0, le=LONGEST_LAG), "s", Option("S")] = 0.0
    """Output each fix S seconds late, smoothed with later fixes: for mapping."""
    accuracy: Annotated[Flag, Option(None, "--no-accuracy", "Ignore the accuracy that the receiver reports.")] = True
    """Use the accuracy that the receiver reports."""
    helm: Annotated[str | None, BeforeValidator(_page), Option("[HOST:PORT]")] = None
    """Serve the helm page; without an address, at 127.0.0.1:8080."""
    helm_token_file: Annotated[str | None, Option("FILE")] = None
    """File with the token for other computers; or set STEERWAY_HELM_TOKEN."""
    helm_origin: Annotated[str | None, Option("https://HOST")] = None
    """Address of the helm page behind a TLS proxy."""
    missions: Annotated[str | None, Option("ADDRESS")] = None
    """Exchange missions with ground stations, such as at udpin:127.0.0.1:14560."""
    mavlink_signing: Annotated[str | None, Option("FILE")] = None
    """Sign MAVLink messages with the passphrase in this file."""
    control: Annotated[str | None, Option("HOST:PORT")] = None
    """Serve a control port for programs on this computer."""
    control_token_file: Annotated[str | None, Option("FILE")] = None
    """File with the port's token; or set STEERWAY_CONTROL_TOKEN."""
    speed: SpeedSettings = SpeedSettings()
    """Speed control."""
    autopilot: AutopilotSettings = AutopilotSettings()
    """Course and heading control."""
    estimator: EstimatorSettings = EstimatorSettings()
    """Estimators of heading and speed."""

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Settings from a TOML file. Raises InputError that names file, key, value and what was expected."""
        return cls.made_of(read_toml(path, "settings"), f"settings {path}")._relative_to(Path(path).parent)

    def overridden(self, **given: Any) -> Self:
        """A copy with the given values, except those that are None. Raises InputError for a value the key refuses."""
        keys = {name: value for name, value in given.items() if value is not None}
        checked = self.made_of({names_of(name, type(self).model_fields[name])[0]: keys[name] for name in keys}, "live")
        return self.model_copy(update={name: getattr(checked, name) for name in keys})

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

"""All that `steerway live` can be told, as one TOML file that is checked before anything runs.

Keys are the command's options, with `_` for `-`; what stands on the command line goes before what stands in the file.
Files that the file names lie beside it, wherever the command is run.
"""

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from steerway.core.toml import read_toml
from steerway.core.validation import refusal
from steerway.live.helm.address import DEFAULT


def _several(value):
    """A text alone is a list of one."""
    return (value,) if isinstance(value, str) else value


def _page(value):
    """`true` is the usual address, `false` none."""
    return {True: DEFAULT, False: None}[value] if isinstance(value, bool) else value


Texts = Annotated[tuple[str, ...], BeforeValidator(_several)]
Aid = Literal["sog", "cog", "heading", "water-speed", "yaw-rate"]


class Settings(BaseModel):
    """The options of `steerway live`, which says what they mean."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    listen_to: Texts = Field((), alias="from")
    say_to: Texts = Field(("stdout:",), alias="to", min_length=1)
    profile: str = "small-usv"
    source: Texts = ()
    aid: Annotated[tuple[Aid, ...], BeforeValidator(_several)] = ()
    rate: float | None = Field(None, gt=0.0, le=1000.0, allow_inf_nan=False, strict=True)
    mission: str | None = None
    engage: bool = Field(False, strict=True)
    patience: float = Field(10.0, gt=0.0, allow_inf_nan=False, strict=True)
    latency: float = Field(0.0, ge=0.0, allow_inf_nan=False, strict=True)
    accuracy: bool = Field(True, strict=True)
    helm: Annotated[str | None, BeforeValidator(_page)] = None
    helm_token_file: str | None = None

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Settings from a TOML file. Raises InputError that names file, key, value and what was expected."""
        try:
            return cls(**read_toml(path, "settings"))._beside(Path(path).parent)
        except ValidationError as error:
            raise refusal(f"settings {path}", error, cls) from None

    def overridden(self, **given) -> Self:
        """The same with what was given in place of what is here; None was not given."""
        return self.model_copy(update={name: value for name, value in given.items() if value is not None})

    def _beside(self, folder):
        """The same with the files it names in `folder`."""
        files = {name: getattr(self, name) for name in ("mission", "helm_token_file")}
        if self.profile.endswith(".toml"):
            files["profile"] = self.profile
        found = {name: str(folder / path) for name, path in files.items() if path is not None}
        found |= {
            name: tuple(_placed(each, folder) for each in getattr(self, name)) for name in ("listen_to", "say_to")
        }
        return self.model_copy(update=found)


def _placed(address, folder):
    scheme, colon, path = address.partition(":")
    return f"file:{folder / path}" if scheme == "file" and colon else address

"""A scenario from a TOML file, checked before anything sails.

What is not a key is refused, and so is what cannot be sailed: every refusal is one sentence with the key's path, the
value and what was expected.
"""

import tomllib
from pathlib import Path

from pydantic import ValidationError

from steerway.core.errors import InputError
from steerway.core.validation import refusal
from steerway.simulation.possible import check
from steerway.simulation.scenario import Scenario


def load_scenario(path: str | Path) -> Scenario:
    """A scenario from a TOML file, checked down to the last block. Raises InputError, one sentence."""
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"scenario {path} cannot be read: {getattr(error, 'strerror', None) or error}") from None
    return parse_scenario(text, f"scenario {path}", Path(path).parent)


def parse_scenario(text: str, place: str = "scenario", folder: Path | None = None) -> Scenario:
    """A scenario from TOML text; `place` names it in errors, `folder` is where a profile's file is looked for."""
    try:
        scenario = Scenario(**tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{place} is no TOML: {error}") from None
    except ValidationError as error:
        raise refusal(place, error, Scenario) from None
    profile = scenario.estimator.profile
    if folder is not None and profile is not None and profile.endswith(".toml") and not Path(profile).is_absolute():
        found = scenario.estimator.model_copy(update={"profile": str(folder / profile)})
        scenario = scenario.model_copy(update={"estimator": found})
    try:
        check(scenario)
    except InputError as error:
        raise InputError(f"{place}: {error}") from None
    return scenario

"""A scenario from a TOML file, checked before the run.

Unknown keys are refused, and so are combinations that cannot be simulated, in one sentence with the key's path, the
value and what was expected.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from steerway.core.errors import InputError
from steerway.core.settings import parse_toml, read_toml, refusal
from steerway.simulation.scenario import Scenario
from steerway.simulation.scenario_checks import check


def load_scenario(path: str | Path, changes: Mapping[str, object] | None = None) -> Scenario:
    """A scenario from a TOML file, checked down to the last block. Raises InputError, one sentence.

    changes: keys in place of the file's, but for None.
    """
    changed = {name: value for name, value in (changes or {}).items() if value is not None}
    return _checked(read_toml(path, "scenario") | changed, f"scenario {path}", Path(path).parent)


def parse_scenario(text: str, place: str = "scenario", folder: Path | None = None) -> Scenario:
    """A scenario from TOML text; `place` names it in errors, `folder` is where a profile's file is looked for."""
    return _checked(parse_toml(text, place), place, folder)


def _checked(tables: dict[str, Any], place: str, folder: Path | None) -> Scenario:
    try:
        scenario = Scenario(**tables)
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

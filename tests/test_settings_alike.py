"""Scenario, mission and settings of live: one strictness and one wording for their numbers."""

from typing import Annotated, get_args

import pytest
from pydantic import BaseModel, TypeAdapter, ValidationError

from steerway.core import InputError
from steerway.live.testing import GeodeticRoute, MissionFile, Settings
from steerway.simulation import Scenario
from tests.command_line import run

POINTS = "[[waypoint]]\nlat_deg = 54.0\nlon_deg = 10.0\n[[waypoint]]\nlat_deg = 54.001\nlon_deg = 10.0\n"
ROUTE = "[route]\nwaypoints = [{north = 0.0, east = 0.0}, {north = 90.0, east = 0.0}]\n"


def said(kind, text, folder):
    """What the command line says of a file, with its exit code."""
    path = folder / f"{kind}.toml"
    if kind == "scenario":
        path.write_text(text + ROUTE)
        code, _, error = run("simulate", path, "-o", folder / "out")
    elif kind == "mission":
        path.write_text(text + POINTS)
        code, _, error = run("live", "--from", "file:none.csv", "--mission", path)
    else:
        path.write_text(text)
        code, _, error = run("live", path)
    return code, error.strip()


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ('"600"', "is '600', expected a number"),
        ("true", "is True, expected a number"),
        ("0", "is 0, expected more than 0.0"),
        ("inf", "is inf, expected"),
    ],
)
def test_a_number_is_refused_with_one_wording(value, expected, tmp_path):
    keys = {"scenario": "duration", "mission": "speed_mps", "settings": "max_dead_reckoning"}
    for kind, key in keys.items():
        code, error = said(kind, f"{key} = {value}\n", tmp_path)
        assert code == 2 and f"{key} {expected}" in error and error.count("\n") == 0, (kind, error)


def test_a_syntax_error_has_one_wording(tmp_path):
    for kind in ("scenario", "mission", "settings"):
        code, error = said(kind, "name = \n", tmp_path)
        assert code == 2 and f"{kind}.toml is not valid TOML: Invalid value" in error, (kind, error)


def test_a_route_of_gpx_has_its_places_as_text(tmp_path):
    path = tmp_path / "route.gpx"
    points = '<rtept lat="{}" lon="10.0"/><rtept lat="54.001" lon="10.0"/>'
    path.write_text(f"<gpx><rte>{points.format('54.0')}</rte></gpx>")
    assert len(GeodeticRoute.load(path).latitude) == 2
    path.write_text(f"<gpx><rte>{points.format('north')}</rte></gpx>")
    with pytest.raises(InputError, match=r"route.gpx is malformed \(could not convert string to float: 'north'\)"):
        GeodeticRoute.load(path)


def numbers_of(model, seen):
    """(table, key, type) of every key of a file that takes no text."""
    if model in seen:
        return
    seen.add(model)
    for name, field in model.model_fields.items():
        whole = Annotated[(field.annotation, *field.metadata)] if field.metadata else field.annotation
        if str not in _leaves(field.annotation):
            yield model.__name__, name, whole
        for inner in _leaves(field.annotation):
            if isinstance(inner, type) and issubclass(inner, BaseModel):
                yield from numbers_of(inner, seen)


def _leaves(annotation):
    inner = get_args(annotation)
    return [annotation] if not inner else [leaf for each in inner for leaf in _leaves(each)]


def test_no_number_and_no_flag_takes_a_text():
    seen: set = set()
    keys = [each for model in (Scenario, MissionFile, Settings) for each in numbers_of(model, seen)]
    taken = []
    for table, key, kind in keys:
        for text in ("2", "1.5", "true"):
            try:
                TypeAdapter(kind).validate_python(text)
            except ValidationError:
                continue
            taken.append((table, key, text))
    assert len(keys) > 150 and not taken

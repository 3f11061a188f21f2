"""Studies of the papers: published numbers compared with measured ones. They use the public names of `steerway` only.

A study is a module or a package with the attribute `STUDY`: its parameters, its run, its comparisons and its figures.
To add one, write it and list it here.
"""

from importlib import import_module

STUDIES = {
    "cybership-observers": "steerway_studies.cybership_observers",
    "adaptive-speed": "steerway_studies.adaptive_speed",
    "otter-course": "steerway_studies.otter_course",
    "mariner-los": "steerway_studies.mariner_los",
    "estimator-limits": "steerway_studies.estimator_limits",
    "springer-mission": "steerway_studies.springer_mission",
    "unseen-logs": "steerway_studies.unseen_logs",
    "at-sea": "steerway_studies.at_sea",
}
"""Study name → module. The entry point `steerway.studies` names this table; other packages may add their own."""


def named(name: str):
    """The `Study` of this name. Raises KeyError if the table has no such name."""
    return import_module(STUDIES[name]).STUDY

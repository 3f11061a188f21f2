"""Studies: one file each, parameters, run, published against measured."""

from importlib import import_module

MODULES = {
    "cybership-observers": "cybership_observers",
    "adaptive-speed": "adaptive_speed",
    "otter-course": "otter_course",
    "mariner-los": "mariner_los",
    "otter-path": "otter_path",
    "ais-prediction": "ais_prediction",
    "low-speed": "low_speed",
    "estimator-limits": "estimator_limits",
    "real-logs": "real_logs",
    "springer-mission": "springer_mission",
    "unseen-logs": "unseen_logs",
}
"""Study name → the module of this package whose STUDY it is; imported only when asked for."""


def named(name: str):
    """The study of this name. Raises InputError with the names there are."""
    from steerway.core.errors import InputError

    if name not in MODULES:
        raise InputError(f"study {name!r} is unknown, expected one of {', '.join(MODULES)}")
    return import_module(f"steerway_studies.{MODULES[name]}").STUDY

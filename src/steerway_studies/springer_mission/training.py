"""Train the networks of `estimation.heading.interval.weighting` on simulated compasses:

    python -m steerway_studies.springer_mission.training -o DIRECTORY

Compasses within ± 1 % of the TCM2, random circuits, seeds that no study uses. Half of the voyages are steered by the
ideal filter, half by a mean of the ideal and the nominal filter, so that the training data contain turns caused by
heading errors. Takes a few minutes; needs scikit-learn (`pip install '.[studies]'`).
"""

import argparse
import math
from functools import partial
from pathlib import Path

import numpy as np

from steerway.core import InputError
from steerway.estimation.heading import WEIGHTS, CompositeFilter, Features, ModelBank, Network, composite_model, corners
from steerway.sensors import TCM2, CompassModel, random_compass
from steerway.simulation import over_seeds
from steerway_studies.springer_mission.world import World, random_circuit, sail

FIRST_SEED = 1_000_000
"""First seed of the training; seeds of studies and tests are smaller."""
VOYAGES = 400
STRIDE = 3
"""Interval, s, between the notes used for training; notes in between carry nearly the same information."""
INNOVATIONS_ONLY = 6
"""Number of features, the first ones, that are computed from the innovation."""


class _Teacher:
    """Steers by a mean of ideal and nominal filter, and notes features, bounds, nominal and ideal heading (°)."""

    def __init__(self, compass, mixed: float, tolerance: float, nominal: CompassModel):
        self.bank = ModelBank(corners(tolerance, nominal))
        self.ideal = CompositeFilter(composite_model(compass))
        self._features, self._mixed = Features(), mixed
        self.notes = []

    @property
    def heading(self) -> float:
        return (1.0 - self._mixed) * self.ideal.heading + self._mixed * self.bank.nominal

    def step(self, difference, readings, velocity) -> float:
        self.bank.step(difference, readings)
        self.ideal.step(difference, readings)
        nominal = math.degrees(self.bank.nominal)
        features = self._features.step(self.bank.innovation, nominal)
        angles = [math.degrees(each) for each in (self.bank.low, self.bank.high, self.ideal.heading)]
        self.notes.append([*features, angles[0], angles[1], nominal, angles[2]])
        return self.heading


def lesson(seed: int, tolerance: float = 0.01, nominal: CompassModel = TCM2) -> np.ndarray:
    """(n, 16) notes of one voyage with a random compass within ± tolerance of `nominal`: 12 features, then low, high,
    nominal and ideal heading in degrees.
    """
    rng = np.random.default_rng(seed)
    compass = random_compass(rng, tolerance, nominal)
    teacher = _Teacher(compass, 0.0 if seed % 2 else rng.uniform(0.0, 0.3), tolerance, nominal)
    sail(World(compass=compass), teacher, rng.spawn(1)[0], random_circuit(rng))
    return np.array(teacher.notes)


def train(notes: np.ndarray, name: str, iterations: int = 60) -> Network:
    """A 24–24 tanh network trained on notes (n, 16); it minimises the squared heading error in degrees²."""
    try:
        from sklearn.neural_network import MLPRegressor
    except ImportError:
        raise InputError("training needs scikit-learn, expected pip install '.[studies]'") from None
    inputs = notes[:, : INNOVATIONS_ONLY if name == "innovations" else 12]
    low, high, nominal, ideal = notes[:, 12:].T
    width = high - low
    if name == "correction":
        target, worth = ideal - nominal, np.ones(len(notes))
    else:
        target, worth = (ideal - low) / np.maximum(width, 1e-9), width**2
    used = width > 1e-3
    mean, scale = inputs[used].mean(axis=0), inputs[used].std(axis=0)
    unit = float(np.std(target[used]))
    learner = MLPRegressor(
        hidden_layer_sizes=(24, 24),
        activation="tanh",
        alpha=1e-6,
        batch_size=500,
        learning_rate_init=5e-3,
        random_state=0,
        max_iter=1,
    )
    scaled, aim = (inputs[used] - mean) / scale, target[used] / unit
    worth = worth[used] / worth[used].mean()
    learner.set_params(warm_start=True)
    for i in range(iterations):
        learner.set_params(learning_rate_init=5e-3 * 0.5 * (1.0 + math.cos(math.pi * i / iterations)) + 1e-5)
        learner.fit(scaled, aim, sample_weight=worth)
    layers = list(zip(learner.coefs_, learner.intercepts_, strict=True))
    layers[-1] = (layers[-1][0] * unit, layers[-1][1] * unit)
    return Network(mean, scale, tuple(layers))


def main(directory: Path, voyages: int = VOYAGES, workers: int | None = None, compass=TCM2, tolerance: float = 0.01):
    """Simulate voyages with compasses within ± tolerance of `compass`, train the networks and write them."""
    taught = partial(lesson, tolerance=tolerance, nominal=CompassModel(*compass))
    directory.mkdir(parents=True, exist_ok=True)
    notes = np.concatenate(over_seeds(taught, range(FIRST_SEED, FIRST_SEED + voyages), workers))[::STRIDE]
    for name, file in WEIGHTS.items():
        train(notes, name).save(directory / file)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Train the networks and write them to a directory.")
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--voyages", type=int, default=VOYAGES)
    parser.add_argument("--workers", type=int)
    parser.add_argument("--compass", type=float, nargs=4, default=TCM2[:4], metavar=("A1", "A2", "B", "K"))
    parser.add_argument("--tolerance", type=float, default=0.01)
    given = parser.parse_args()
    main(given.output, given.voyages, given.workers, given.compass, given.tolerance)

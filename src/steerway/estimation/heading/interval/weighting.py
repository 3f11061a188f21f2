"""One heading from bounds: inf + w (sup − inf), P4 (19), and a network that estimates w from a filter's innovations.

The network is P4's idea (§6): innovations of the nominal filter depend on the error of its compass model. Inputs are
means of the innovation over the last 1 to 200 s and its sum, and the same of the heading: the effect of a wrong gain
grows with it.
"""

import math
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.arrays import Floats
from steerway.core.errors import InputError
from steerway.estimation.heading.model_bank import ModelBank, corners

SPANS = np.array([1.0, 5.0, 20.0, 60.0, 200.0])
"""Time constants of the means, s. The networks of this package were trained with them."""
WEIGHTS = {"weight": "weight.npz", "innovations": "weight_innovations.npz", "correction": "correction.npz"}
"""Network files: the weight; the weight from innovations alone; a correction of the nominal heading."""


def weighted(low: float, high: float, weight: float) -> float:
    """The heading at `weight` (0 to 1) between two bounds, P4 (19)."""
    return low + weight * (high - low)


def ideal_weight(low: float, high: float, ideal: float) -> float:
    """The weight at which `weighted` returns the ideal estimate, P4 (20); NaN if the bounds coincide."""
    return (ideal - low) / (high - low) if high > low else math.nan


class Features:
    """Running means of innovation (deg) and heading (deg): 5 means and a scaled sum of each, (12,)."""

    def __init__(self) -> None:
        self._means = np.zeros((2, len(SPANS)))
        self._sums = np.zeros(2)

    def step(self, innovation_deg: float, heading_deg: float, dt: float = 1.0) -> Floats:
        """The features after dt s more; an unknown (NaN) innovation or heading leaves its features unchanged."""
        now = np.array([innovation_deg, heading_deg])
        known, left = np.isfinite(now), np.exp(-dt / SPANS)
        self._means[known] = (left * self._means + (1.0 - left) * now[:, None])[known]
        self._sums[known] += now[known] * dt / SPANS[-1]
        return np.concatenate([self._means[0], self._sums[:1], self._means[1], self._sums[1:]])


@dataclass(frozen=True, eq=False)
class Network:
    """A perceptron: scaled inputs, tanh layers, a linear output."""

    mean: Floats
    scale: Floats
    layers: tuple[tuple[Floats, Floats], ...]  # (weights (in, out), biases (out,)) each

    def __call__(self, features: Floats) -> float:
        x = (features[: len(self.mean)] - self.mean) / self.scale
        for weights, biases in self.layers[:-1]:
            x = np.tanh(x @ weights + biases)
        weights, biases = self.layers[-1]
        return float((x @ weights + biases)[0])

    def save(self, path: str | Path | IO[bytes]) -> None:
        """Write as .npz in single precision."""
        layers = {
            f"{kind}{i}": each for i, pair in enumerate(self.layers) for kind, each in zip("wb", pair, strict=True)
        }
        arrays: dict[str, Any] = {"mean": self.mean, "scale": self.scale, **layers}
        np.savez_compressed(path, **{name: value.astype(np.float32) for name, value in arrays.items()})

    @classmethod
    def load(cls, path: str | Path | IO[bytes]) -> "Network":
        with np.load(path) as stored:
            arrays = {name: stored[name].astype(np.float64) for name in stored.files}
        n = sum(name.startswith("w") for name in arrays)
        return cls(arrays["mean"], arrays["scale"], tuple((arrays[f"w{i}"], arrays[f"b{i}"]) for i in range(n)))


@cache
def shipped(name: str) -> Network:
    """A network of this package by name; raises InputError for another name."""
    if name not in WEIGHTS:
        raise InputError(f"network {name!r} is unknown, expected one of {', '.join(WEIGHTS)}")
    with files("steerway.estimation.heading.interval").joinpath(WEIGHTS[name]).open("rb") as stored:
        return Network.load(stored)


class LearnedHeading:
    """Heading from the bounds of a bank of filters and a network; works for compasses within ± 1 % of the TCM2's.

    name: "weight" or "innovations" weigh the bounds, "correction" corrects the nominal filter and needs no bounds.
    bank: of another compass and tolerance, with the network that was trained for them. Raises InputError for a bank
    without a network.
    """

    def __init__(self, name: str = "weight", network: Network | None = None, bank: ModelBank | None = None) -> None:
        if bank is not None and network is None:
            raise InputError("heading.network is missing, expected one that was trained for the bank's compasses")
        self._network = network or shipped(name)
        self._corrects = name == "correction"
        self.bank = bank or ModelBank(corners(0.01))
        self._features = Features()
        self.heading = 0.0
        self.weight = math.nan

    @property
    def low(self) -> float:
        return self.bank.low

    @property
    def high(self) -> float:
        return self.bank.high

    def step(
        self, difference: float, readings: ArrayLike | None = None, dt: float = 1.0, times: ArrayLike | None = None
    ) -> float:
        """As `CompositeFilter.step`; returns the heading (rad)."""
        self.bank.step(difference, readings, dt, times)
        output = self._network(self._features.step(self.bank.innovation, math.degrees(self.bank.nominal), dt))
        if self._corrects:
            self.heading = self.bank.nominal + math.radians(output)
        else:
            self.weight = min(max(output, 0.0), 1.0)
            self.heading = weighted(self.low, self.high, self.weight)
        return self.heading

"""Row by row, as in a control loop: predict at 50 Hz, update with fixes at 5 Hz."""

import copy

import numpy as np

from benchmarks.support import ours, peers
from benchmarks.support.harness import Result, interleaved
from benchmarks.support.record import winding

_START, _ROWS, _ROUNDS = 200, 5000, 7
_TARGETS = {"filterpy": 25.0, "Stone Soup": 140.0}


def run():
    record = winding(_START + _ROWS)
    begun = ours.started(record, _START)
    kinds = {"filterpy": peers.FilterPy, "Stone Soup": peers.StoneSoup}
    positions = record.positions(_START, _START + _ROWS)

    estimator = copy.deepcopy(begun)
    ours.stream(estimator, positions)
    for name, kind in kinds.items():
        peer = kind(begun.state, begun.covariance)
        peer.stream(positions)
        yield Result(f"largest difference to {name}", _difference(estimator, peer), "", at_most=1e-9)

    contenders = {"ours": _fresh(lambda: copy.deepcopy(begun), ours.stream, positions)}
    for name, kind in kinds.items():
        contenders[name] = _fresh(lambda kind=kind: kind(begun.state, begun.covariance), kind.stream, positions)
    taken = interleaved(contenders, _ROUNDS)
    yield Result("one step of ours", 1e6 * taken["ours"] / _ROWS, "µs")
    for name, target in _TARGETS.items():
        per_step = f"{1e6 * taken[name] / _ROWS:.1f} µs a step"
        yield Result(f"{name} / ours", taken[name] / taken["ours"], "times", at_least=target, note=per_step)


def _fresh(make, stream, positions):
    """Work on a filter that was made before: the time to make it does not count."""
    made = [make() for _ in range(_ROUNDS + 1)]
    return lambda: stream(made.pop(), positions)


def _difference(estimator, peer) -> float:
    """Largest difference in state (course modulo 2π) and covariance."""
    gap = estimator.state - peer.x
    gap[3] = np.remainder(gap[3] + np.pi, 2.0 * np.pi) - np.pi
    return float(max(np.abs(gap).max(), np.abs(estimator.covariance - peer.p).max()))

"""The literal interval Kalman step on codac's matrices, run as a program of its own: `python codac_step.py`.

codac switches the rounding mode of the whole process, so nothing of Steerway is imported here. Reads the box (14 pairs)
and the readings as JSON on standard input; writes seconds a step and the last bounds of the state.
"""

import json
import sys
import time

from codac import Interval, IntervalMatrix, IntervalVector, Matrix


def constant(rows):
    return IntervalMatrix(Matrix(rows))


def run(box, readings):
    coefficient = [Interval(*pair) for pair in box]
    outputs, (a1, a2, b, k, shift), (_, noise, spread) = coefficient[4:6], coefficient[6:11], coefficient[11:14]
    identity = constant([[float(i == j) for j in range(4)] for i in range(4)])
    x = IntervalVector([Interval(0.0)] * 4)
    p = constant([[1e-12, 0, 0, 0], [0, 1e-12, 0, 0], [0, 0, 1.0, 0], [0, 0, 0, 1.0]])
    added = IntervalMatrix(4, 4)
    added.init(Interval(0.0))
    added[2, 2] = added[3, 3] = noise
    row = IntervalMatrix(1, 4)
    row.init(Interval(0.0))
    row[0, 2] = k
    start = time.perf_counter()
    for reading in readings:
        move = IntervalMatrix(identity)
        move[2, 0], move[2, 1], move[2, 2], move[2, 3] = b * outputs[0], b * outputs[1], a1, a2
        move[3, 2], move[3, 3] = shift, Interval(0.0)
        x = move * x
        p = move * p * move.transpose() + added
        s = (row * p * row.transpose())[0, 0] + spread
        crossed = p * row.transpose()
        innovation = Interval(reading) - k * x[2]
        left = IntervalMatrix(identity)
        for i in range(4):
            gain = crossed[i, 0] / s
            left[i, 2] -= gain * k
            x[i] += gain * innovation
        p = left * p
    taken = time.perf_counter() - start
    return taken / len(readings), [[x[i].lb(), x[i].ub()] for i in range(4)]


if __name__ == "__main__":
    given = json.load(sys.stdin)
    best = min(run(given["box"], given["readings"])[0] for _ in range(5))
    json.dump({"seconds": best, "state": run(given["box"], given["readings"])[1]}, sys.stdout)

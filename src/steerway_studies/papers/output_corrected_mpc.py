"""An MPC made offset-free as textbooks print it, for comparison with the product's."""

import math


class OutputCorrectedMpc:
    """A HeadingMpc whose plant states run free: the last output error is added to the prediction (step-response MPC).

    On a plant that is not asymptotically stable the free states drift off, and with them the prediction.
    """

    def __init__(self, mpc):
        self._mpc = mpc
        mpc.reset(0.0)

    def step(self, wanted: float, estimated: float) -> float:
        error = estimated - self._mpc.observer.output
        return self._mpc.step(wanted - error, math.nan)

"""The declared response of a boat to orders."""

from typing import NamedTuple


class Response(NamedTuple):
    """The response of a boat to orders, and how uncertain it is; SI, rad. Every `_std` is 1σ.

    Yaw rate: `time` T (s), `linear` d_0, `munk` m (s²/m²), `quadratic` n (s/rad) and `integral` i (1/s) as in `motion`;
    `rate`: the largest ordered one; `wander`: 1σ about the response; `bias_std`: of its bias; `wind_std`: of what the
    wind adds to the bias, north and east; `manual`: 1σ under an unknown helmsman. These four are shares of `rate`.
    Speed through the water: `speed`: the usual one, and `top_speed`: the largest; `speed_time`: its time constant (s);
    `speed_noise`: 1σ about the response, as a share of `speed`; `slip`: this 1σ in a turn at `rate`; `loss`: share of
    the speed that such a turn takes, in proportion to the square of the yaw rate, if no speed loop restores it.
    `over_ground`: whether an ordered speed is one over ground along the bow, as for vehicles with a speed loop of
    their own. `time_std`: of T, and of an ordered speed above the largest, both as shares.
    Current: `current`: 1σ of its components at the start, as a share of `speed`; `current_noise`: spectral density of
    its changes (m²/s³). Sway: `slip_time`: its time constant (s), with `slip_std`.
    `pivot`: distance (m) from the point whose position is measured forward to the point that moves along the bow.
    """

    time: float
    rate: float
    speed: float
    top_speed: float
    linear: float = 1.0
    munk: float = 0.0
    quadratic: float = 0.0
    speed_time: float = 2.0
    wander: float = 0.02
    gain_std: float = 0.15
    damping_std: float = 0.3
    bias_std: float = 0.12
    wind_std: float = 0.25
    current: float = 0.5
    current_noise: float = 1e-4
    speed_noise: float = 0.05
    speed_gain_std: float = 0.1
    slip: float = 0.05
    manual: float = 0.5
    over_ground: bool = False
    pivot: float = 0.0
    time_std: float = 0.0
    integral: float = 0.0
    slip_time: float = 0.0
    slip_std: float = 0.0
    loss: float = 0.0

    @property
    def packed(self) -> "Response":
        """As kernels take it: all numbers are floats."""
        return Response._make(map(float, self))

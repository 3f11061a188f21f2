"""The declared response of a boat to orders."""

from typing import NamedTuple


class Response(NamedTuple):
    """The response of a boat to orders, and how uncertain it is; SI, rad. Deviations are 1σ.

    time T (s), linear d_0, munk m (s²/m²) and quadratic n (s/rad) of the yaw rate; rate: the largest that is ordered;
    speed: usual through the water, top_speed the largest; speed_time: its time constant, s; wander: of the yaw rate
    beside the response, as a share of `rate`; wind_std: of what the wind adds to the bias, north and east, as a share
    of `rate`; current: of its components at the start, in shares of the speed, and current_noise, spectral density of
    its changes, m²/s³; speed_noise: 1σ of the speed through the water beside its
    response, and speed_gain_std of that, in shares; slip: lost share of the speed in a turn at `rate`; manual: yaw
    rate of an unknown helmsman, as a share of `rate`; over_ground: whether an ordered speed is one over ground along
    the bow, as of vehicles with a speed loop of their own, else one through the water; pivot: m that the point which
    moves along the bow, in a turn too, lies ahead of the one whose position is measured; time_std: of T, and of
    what an ordered speed is beyond the largest, as a share; integral i (1/s): of the vehicle's own yaw-rate loop;
    slip_time and slip_std: of the sway, s.
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

    @property
    def packed(self) -> "Response":
        """As kernels take it: all numbers are floats."""
        return Response._make(map(float, self))

"""P0 (60)–(63) as printed: one propeller gain for ahead and astern, no limits. For studies and tests."""

import math

GAIN = 0.0111
"""k in kg·m, P0 (60)."""

ARM = 0.395
"""m; l_1 = −0.395 belongs to the port propeller, l_2 = 0.395 to the starboard one."""


def propeller_speeds(surge_force, yaw_moment):
    """(n_1, n_2) in rad/s for a surge force (N) and yaw moment (N·m)."""
    half = yaw_moment / ARM
    return tuple(
        math.copysign(math.sqrt(abs(square)), square)
        for square in (0.5 * (surge_force + half) / GAIN, 0.5 * (surge_force - half) / GAIN)
    )

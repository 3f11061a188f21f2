"""Forces of the public CyberShip II simulation."""

import math


def public_forces(time):
    """The forces of the public simulator's run, held over each of its steps."""
    return 0.5 + 1.2 * math.sin(0.1 * time), 0.8 * math.cos(0.07 * time), 0.15 * math.sin(0.05 * time)

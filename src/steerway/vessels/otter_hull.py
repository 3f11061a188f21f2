"""Particulars of the Otter, and the model parameters that depend on the load only.

Maritime Robotics' Otter: catamaran of 2.0 m and 55 kg with a fixed propeller in each pontoon. Particulars and the
editions follow T. I. Fossen's public Marine Systems Simulator; the relations are those of his Handbook of Marine Craft
Hydrodynamics and Motion Control, 2nd ed. (2021), called FH below.

There are two editions because the papers used an older one:

- "today" (2026): payload inertia about the common centre of gravity, payload weight sinks and trims the hull, linear
  sway damping, Munk moment, heave and pitch cross-flow drag, acceleration of the current in the rotating body frame;
- "2021", P0's: inertia with arms from the origin, to which the shift to the origin is added a second time (M66 =
  41.445 kg·m² with 25 kg at [0, 0, −0.35] m), no payload weight but a steady trim moment of 280 N·m bow down, no
  linear sway damping, no Munk moment in yaw, cross-flow drag in sway and yaw only, in water of 1026 kg/m³, and no
  acceleration of the current.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from steerway.control.allocation import OTTER_PROPELLERS
from steerway.core.arrays import Floats
from steerway.core.errors import InputError

GRAVITY = 9.81
WATER_DENSITY = 1025.0
KNOT = 0.5144  # as the particulars round it

LENGTH = 2.0
BEAM = 1.08
MASS = 55.0
CENTRE_OF_GRAVITY = np.array([0.2, 0.0, -0.2])  # of the bare hull, from the origin amidships
GYRATION = np.array([0.4 * BEAM, 0.25 * LENGTH, 0.25 * LENGTH])
CENTRE_OF_FLOTATION = -0.2  # aft of the origin
TOP_SPEED = 6.0 * KNOT
BOLLARD_PULL_AHEAD = 24.4 * GRAVITY
MAX_PAYLOAD = 45.0

PONTOON_BEAM = 0.25
PONTOON_ARM = 0.395  # from the centre line to a pontoon's centre, and so to its propeller
WATERLINE_COEFFICIENT = 0.75
BLOCK_COEFFICIENT = 0.4

SWAY_TIME_CONSTANT = 1.0
YAW_TIME_CONSTANT = 1.0
STRIPS = 21  # stations L/20 apart, both ends counted

# Hoerner's two-dimensional drag coefficient over beam/(2 draught); Leite et al. (1998), Applied Ocean Research 20.
_HOERNER = np.array(
    [
        (0.0108623, 1.96608),
        (0.176606, 1.96573),
        (0.353025, 1.89756),
        (0.451863, 1.78718),
        (0.472838, 1.58374),
        (0.492877, 1.27862),
        (0.493252, 1.21082),
        (0.558473, 1.08356),
        (0.646401, 0.998631),
        (0.833589, 0.87959),
        (0.988002, 0.828415),
        (1.30807, 0.759941),
        (1.63918, 0.691442),
        (1.85998, 0.657076),
        (2.31288, 0.630693),
        (2.59998, 0.596186),
        (3.00877, 0.586846),
        (3.45075, 0.585909),
        (3.7379, 0.559877),
        (4.00309, 0.559315),
    ]
)


@dataclass(frozen=True)
class Edition:
    """Differences between the public editions of the model."""

    inertia_about_origin: bool
    payload_weighs: bool
    trim_moment: float  # N·m, bow down
    sway_damping: bool
    munk_in_yaw: bool
    vertical_drag: bool
    drag_density: float
    current_turns: bool  # the current's acceleration in the body frame


EDITIONS = {
    "today": Edition(False, True, 0.0, True, True, True, WATER_DENSITY, True),
    "2021": Edition(True, False, 280.0, False, False, False, 1026.0, False),
}

# Offsets in the array of parameters.
INVERSE = 0  # 36: inverse of the mass matrix, row by row
INERTIA = 36  # 9: rigid-body inertia about the centre of gravity
CENTRE = 45  # 3: centre of gravity
ADDED = 48  # 6: added mass
DAMPING = 54  # 6: linear damping, positive
STIFFNESS = 60  # 3: heave, roll, pitch about the centre of flotation
PAYLOAD = 63  # 3: position of the payload
WEIGHT, TOTAL_MASS, SIDE_DRAG, VERTICAL_DRAG, MUNK, CURRENT_TURNS, TRIM_MOMENT = range(66, 73)


def mass_matrix(
    payload_mass: float = 0.0, payload_position: Sequence[float] = (0.0, 0.0, 0.0), edition: str = "today"
) -> np.ndarray:
    """The 6 × 6 mass matrix about the origin, rigid body and added mass (kg, kg·m, kg·m²); FH (3.49), (6.47)."""
    centre, inertia, total = _rigid_body(payload_mass, np.asarray(payload_position, dtype=float), _edition(edition))
    shift = np.eye(6)
    shift[:3, 3:] = -_cross(centre)
    about_centre = np.zeros((6, 6))
    about_centre[:3, :3] = total * np.eye(3)
    about_centre[3:, 3:] = inertia
    return shift.T @ about_centre @ shift + np.diag(_added_mass(inertia))


def loaded(payload_mass: float, payload_position: Sequence[float], edition: str) -> np.ndarray:
    """Parameters for a load, as the array that the kernels read; computed once per load."""
    try:
        return _loaded(payload_mass, payload_position, edition)
    except TypeError:  # a list or an array: not hashable
        return _loaded(float(payload_mass), tuple(float(each) for each in payload_position), edition)


@lru_cache(maxsize=256)
def _loaded(payload_mass: float, payload_position: Sequence[float], edition: str) -> Floats:
    chosen = _edition(edition)
    position = np.array(payload_position, dtype=float)
    if position.shape != (3,) or not np.isfinite(position).all():
        raise InputError(f"otter.payload_position is {payload_position}, expected (forward, starboard, down) in m")
    if not 0.0 <= payload_mass <= MAX_PAYLOAD:
        raise InputError(f"otter.payload_mass is {payload_mass} kg, expected 0 to {MAX_PAYLOAD:g} kg")
    centre, inertia, total = _rigid_body(payload_mass, position, chosen)
    mass = mass_matrix(payload_mass, payload_position, edition)
    displaced = total / WATER_DENSITY
    draught = displaced / (2.0 * BLOCK_COEFFICIENT * PONTOON_BEAM * LENGTH)
    stiffness = _stiffness(displaced, draught, draught - centre[2])
    coefficient = float(np.interp(PONTOON_BEAM / (2.0 * draught), *_HOERNER.T))
    drag = 0.5 * chosen.drag_density * draught * LENGTH / (STRIPS - 1) * coefficient
    weight = payload_mass * GRAVITY if chosen.payload_weighs else 0.0
    switches = (float(chosen.munk_in_yaw), float(chosen.current_turns), chosen.trim_moment)
    hull = np.concatenate(
        [
            np.linalg.inv(mass).ravel(),
            inertia.ravel(),
            centre,
            _added_mass(inertia),
            _damping(mass, stiffness, chosen),
            stiffness,
            position,
            (weight, total, drag, drag if chosen.vertical_drag else 0.0, *switches),
        ]
    )
    return hull


def _edition(name: str) -> Edition:
    if name not in EDITIONS:
        raise InputError(f"otter.edition is {name!r}, expected one of {', '.join(EDITIONS)}")
    return EDITIONS[name]


def _rigid_body(payload_mass: float, payload_position: Floats, edition: Edition) -> tuple[Floats, Floats, float]:
    """Centre of gravity (3,), inertia (3, 3) about it and total mass of hull and payload; FH section 3.3."""
    total = MASS + payload_mass
    centre = (MASS * CENTRE_OF_GRAVITY + payload_mass * payload_position) / total
    hull_arm, payload_arm = CENTRE_OF_GRAVITY - centre, payload_position - centre
    if edition.inertia_about_origin:
        hull_arm, payload_arm = centre, payload_position
    inertia = MASS * np.diag(GYRATION**2) + _steiner(MASS, hull_arm) + _steiner(payload_mass, payload_arm)
    return centre, inertia, total


def _added_mass(inertia: Floats) -> Floats:
    """Diagonal added mass: Söding (1982) in surge, fractions of mass and inertia otherwise."""
    surge = 2.7 * WATER_DENSITY * (MASS / WATER_DENSITY) ** (5.0 / 3.0) / LENGTH**2
    rotation = np.array([0.2, 0.8, 1.7]) * np.diag(inertia)
    return np.array([surge, 1.5 * MASS, 1.0 * MASS, *rotation])


def _stiffness(displaced: float, draught: float, centre_height: float) -> Floats:
    """Restoring stiffness in heave (N/m), roll and pitch (N·m/rad) about the centre of flotation; FH section 4.2."""
    cw = WATERLINE_COEFFICIENT
    waterline = cw * LENGTH * PONTOON_BEAM  # of one pontoon
    own = LENGTH * PONTOON_BEAM**3 / 12.0 * 6.0 * cw**3 / ((1.0 + cw) * (1.0 + 2.0 * cw))
    across = 2.0 * (own + waterline * PONTOON_ARM**2)
    along = 0.8 * 2.0 * PONTOON_BEAM * LENGTH**3 / 12.0
    buoyancy_height = (2.5 * draught - 0.5 * displaced / (LENGTH * PONTOON_BEAM)) / 3.0
    metacentric_heights = buoyancy_height + np.array([across, along]) / displaced - centre_height
    heave = WATER_DENSITY * GRAVITY * 2.0 * waterline
    return np.array([heave, *(WATER_DENSITY * GRAVITY * displaced * metacentric_heights)])


def _damping(mass: Floats, stiffness: Floats, edition: Edition) -> Floats:
    """Linear damping from top speed, time constants and damping ratios of 0.3, 0.2 and 0.4; FH section 6.4."""
    own = np.diag(mass)
    oscillating = 2.0 * np.array([0.3, 0.2, 0.4]) * np.sqrt(stiffness / own[2:5]) * own[2:5]
    surge = BOLLARD_PULL_AHEAD / TOP_SPEED
    sway = own[1] / SWAY_TIME_CONSTANT if edition.sway_damping else 0.0
    return np.array([surge, sway, *oscillating, own[5] / YAW_TIME_CONSTANT])


def _cross(r: Floats) -> Floats:
    """The matrix of the cross product r ×."""
    return np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])


def _steiner(mass: float, arm: Floats) -> Floats:
    """Inertia (3, 3) of a mass at an arm, by the parallel-axis theorem."""
    return mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))


PROPELLER_GAIN_AHEAD, PROPELLER_GAIN_ASTERN = OTTER_PROPELLERS.gain_ahead, OTTER_PROPELLERS.gain_astern
PROPELLER_MAX, PROPELLER_MIN = OTTER_PROPELLERS.max_speed, OTTER_PROPELLERS.min_speed

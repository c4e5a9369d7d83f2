"""What differs from one built robot, floor and start to the next: random numbers of a seed."""

from dataclasses import dataclass
from typing import Tuple

import numpy as np

from .._errors import InputError

Four = Tuple[float, float, float, float]


@dataclass(frozen=True)
class Variation:
    """One robot on one floor. The default is the nominal one; units are in the names."""

    pose_deg: Four = (0.0, 0.0, 0.0, 0.0)
    """Added to the joints of the first pose, deg."""
    pitch_deg: float = 0.0
    """Lean of the trunk, forwards: at the start in the plane, all the time on the boom, deg."""
    mass_factor: float = 1.0
    """Of all masses; no unit."""
    friction: float = 0.8
    """Coefficient of the floor and the feet; no unit."""
    com_mm: Tuple[float, float] = (0.0, 0.0)
    """Moves the trunk's centre of mass, forwards and up, mm."""
    trim_deg: Four = (0.0, 0.0, 0.0, 0.0)
    """Error of each servo's neutral angle, deg."""
    band_deg: float = 5.0
    """Proportional band of the servos, deg."""
    stall_factor: float = 1.0
    """Stall torque to that of the data sheet; no unit."""
    slope_deg: float = 0.0
    """Of the floor, upwards, deg."""


#: Kinds of seeds.
KINDS = ("standard", "wide")


def variation(seed: int, kind: str = "standard") -> Variation:
    """The variation of a seed, 0 or more; 0 is the nominal robot.

    ``standard``: first pose with a standard deviation of 2 deg a joint, lean 1 deg, mass within 10 %, friction 0.6 to 1.0. ``wide`` has the same, and
    the trunk's centre of mass within 5 mm forwards and 15 mm up, trim with a standard deviation of 0.7 deg, proportional band 3.4 to 6.9 deg, stall
    torque within 10 %, slope within 1 deg.
    """
    if kind not in KINDS:
        raise InputError(f"kind of seeds = '{kind}': allowed is one of {', '.join(KINDS)}")
    if seed < 0:
        raise InputError(f"seed = {seed}: allowed is 0 or more")
    if seed == 0:
        return Variation()
    random = np.random.default_rng(seed)

    def four(deviation: float) -> Four:
        first, second, third, fourth = (float(value) for value in random.normal(0.0, deviation, 4))
        return first, second, third, fourth

    def within(least: float, most: float) -> float:
        return float(random.uniform(least, most))

    pose, pitch, mass, friction = four(2.0), float(random.normal(0.0, 1.0)), within(0.9, 1.1), within(0.6, 1.0)
    if kind == "standard":
        return Variation(pose, pitch, mass, friction)
    com = within(-5.0, 5.0), within(-15.0, 15.0)
    return Variation(pose, pitch, mass, friction, com, four(0.7), within(3.4, 6.9), within(0.9, 1.1), within(-1.0, 1.0))

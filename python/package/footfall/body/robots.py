"""Masses and lengths of the bodies: each number with its source or its reason. SI units."""

from dataclasses import dataclass
from typing import Dict

from .._errors import InputError


@dataclass(frozen=True)
class Segment:
    """A rigid part of the body; lengths in m, from its upper joint downwards."""

    mass_kg: float
    """Mass, kg."""
    length_m: float
    """From its upper joint to the next one, or to the sole, m."""
    com_m: float
    """From its upper joint to its centre of mass, m."""
    gyration_m: float
    """Radius of gyration about its centre of mass, m."""


@dataclass(frozen=True)
class Foot:
    """An arc that is rigid with the shank; it rolls on the floor. Units in the names."""

    mass_kg: float
    """Mass, kg."""
    length_m: float
    """Along the arc, m."""
    radius_m: float
    """Of the arc, m."""
    forward_m: float
    """From the shank's line to the middle of the arc, forwards, m."""


@dataclass(frozen=True)
class Robot:
    """A planar biped: a trunk, two thighs, two shanks with feet. Units in the names."""

    name: str
    """Name on the command line; no unit."""
    trunk: Segment
    """Its length and its centre of mass are measured upwards from the hip, m."""
    thigh: Segment
    shank: Segment
    """Its length goes to the sole, m."""
    foot: Foot
    servo: str
    """Name of the servo of all four joints, for ``footfall.Servo``; empty where none is strong enough."""
    supply_v: float
    """Supply of the servos, V."""

    @property
    def mass_kg(self) -> float:
        """Whole mass, kg."""
        return self.trunk.mass_kg + 2.0 * (self.thigh.mass_kg + self.shank.mass_kg + self.foot.mass_kg)

    @property
    def hip_m(self) -> float:
        """From the hip to the sole of a straight leg, m."""
        return self.thigh.length_m + self.shank.length_m


def _rod(mass_kg: float, length_m: float, com_m: float) -> Segment:
    """A part with the radius of gyration of a uniform rod of its length: a drawing of the part is better."""
    return Segment(mass_kg, length_m, com_m, length_m / 12.0**0.5)


#: Legs of printed brackets. A standard servo weighs 55 g (MG996R, TowerPro): a thigh is the knee's servo, its bracket, horn and bearing; the trunk is
#: two hip servos, a board (about 75 g), a battery (about 200 g) and the frame. The foot is an arc because a flat one on a joint without a drive
#: drags its toe.
DESK = Robot(
    "desk",
    trunk=_rod(0.66, 0.14, 0.05),
    thigh=_rod(0.14, 0.11, 0.07),
    shank=_rod(0.09, 0.14, 0.06),
    foot=Foot(0.04, 0.09, 0.10, 0.015),
    servo="MG996R",
    supply_v=6.0,
)

#: The desk robot at 0.6 of its lengths with servos of 9 g; the trunk has the board and a small battery.
MINI = Robot(
    "mini",
    trunk=_rod(0.17, 0.08, 0.03),
    thigh=_rod(0.03, 0.066, 0.042),
    shank=_rod(0.02, 0.084, 0.036),
    foot=Foot(0.015, 0.054, 0.06, 0.009),
    servo="SG90",
    supply_v=6.0,
)


def person(mass_kg: float = 70.0, height_m: float = 1.75) -> Robot:
    """A person's segments (D. A. Winter, Biomechanics and Motor Control of Human Movement, 4th ed. 2009, table 4.1 and figure 4.1), kg and m.

    Shares of the body mass: head, arms and trunk 0.678, thigh 0.100, leg 0.0465, foot 0.0145. Centres of mass from the upper joint: thigh and leg
    0.433, head, arms and trunk 0.626 from the hip. Radii of gyration about them: 0.323, 0.302, 0.496. Lengths of the height: thigh 0.245, leg 0.246,
    ankle 0.039, foot 0.152, hip to shoulder 0.288. No hobby servo moves it: it is for the torque that the motion asks for.
    """
    thigh_m, leg_m, ankle_m, trunk_m = (share * height_m for share in (0.245, 0.246, 0.039, 0.288))
    return Robot(
        "person",
        trunk=Segment(0.678 * mass_kg, trunk_m, 0.626 * trunk_m, 0.496 * trunk_m),
        thigh=Segment(0.100 * mass_kg, thigh_m, 0.433 * thigh_m, 0.323 * thigh_m),
        shank=Segment(0.0465 * mass_kg, leg_m + ankle_m, 0.433 * leg_m, 0.302 * leg_m),
        # An arc of 0.3 leg lengths: persons' feet and ankles roll like one (the reason for its radius: a rocker that holds the hip level).
        foot=Foot(0.0145 * mass_kg, 0.152 * height_m, 0.3 * (thigh_m + leg_m + ankle_m), 0.03 * height_m),
        servo="",
        supply_v=0.0,
    )


ROBOTS: Dict[str, Robot] = {robot.name: robot for robot in (DESK, MINI, person())}


def named(name: str) -> Robot:
    """The robot of a name; ``InputError`` for another one."""
    if name not in ROBOTS:
        raise InputError(f"robot = '{name}': allowed is one of {', '.join(ROBOTS)}")
    return ROBOTS[name]

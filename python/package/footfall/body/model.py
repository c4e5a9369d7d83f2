"""The body as a model of MuJoCo: a planar biped with driven hips and knees and arc feet, on one of three rigs.

x is forwards, z up. Flexion is positive: a flexed hip has the thigh in front, a flexed knee has the shank behind.
"""

import math
from typing import Any, List

from .._errors import InputError
from ._extra import mujoco
from .robots import Foot, Robot, Segment
from .seeds import Variation

#: ``hung``: the trunk is fixed, the feet are in the air. ``boom``: free height and way forwards, the lean is held. ``free``: free in the plane.
RIGS = ("hung", "boom", "free")

#: Time step, s: the control period of the boards.
STEP_S = 0.001
GRAVITY_M_S2 = 9.81
#: Half the distance of the legs, m; only contacts and pictures see it, since the body moves in a plane.
_APART_M = 0.04
#: The arc is a row of small balls so close together that its sag between two of them is below 0.05 mm.
_BALL_M = 0.004
_SAG_M = 0.00005
#: Mechanical end stops of the joints, beyond the robot's range, rad.
_STOP_RAD = math.radians(5.0)


def _trunk(rig: str, lean: float) -> str:
    """The degrees of freedom of the trunk. Axes are those of the leaning trunk, so they are turned back: the floor's, whatever the lean (rad)."""
    if rig == "hung":
        return ""
    cos, sin = math.cos(lean), math.sin(lean)
    slides = f'<joint name="x" type="slide" axis="{cos!r} 0 {sin!r}"/><joint name="z" type="slide" axis="{-sin!r} 0 {cos!r}"/>'
    return slides + ('<joint name="pitch" type="hinge" axis="0 1 0"/>' if rig == "free" else "")


def _inertial(mass: float, x: float, z: float, inertia: float) -> str:
    # Only the second moment acts: the body turns about y alone.
    return f'<inertial mass="{mass!r}" pos="{x!r} 0 {z!r}" diaginertia="{inertia!r} {inertia!r} {inertia!r}"/>'


def _segment(segment: Segment, factor: float) -> str:
    mass = segment.mass_kg * factor
    return _inertial(mass, 0.0, -segment.com_m, mass * segment.gyration_m**2)


def _shank(shank: Segment, foot: Foot, factor: float) -> str:
    """Shank and foot are one rigid body; the foot's mass is in the middle of its arc, 20 % of the radius above the floor at most."""
    x, z = foot.forward_m, -shank.length_m + min(0.2 * foot.radius_m, 0.01)
    mass = (shank.mass_kg + foot.mass_kg) * factor
    at_x = foot.mass_kg * x / (shank.mass_kg + foot.mass_kg)
    at_z = (-shank.mass_kg * shank.com_m + foot.mass_kg * z) / (shank.mass_kg + foot.mass_kg)
    inertia = shank.mass_kg * (shank.gyration_m**2 + at_x**2 + (at_z + shank.com_m) ** 2)
    inertia += foot.mass_kg * (foot.length_m**2 / 12.0 + (x - at_x) ** 2 + (z - at_z) ** 2)
    return _inertial(mass, at_x, at_z, inertia * factor)


def arc(shank: Segment, foot: Foot) -> List["tuple[float, float]"]:
    """Middles of the balls of the arc in the shank's frame, x and z in m."""
    apart = math.sqrt(8.0 * foot.radius_m * _SAG_M)
    count = max(3, math.ceil(foot.length_m / apart) + 1)
    reach = foot.radius_m - _BALL_M
    angles = [foot.length_m / foot.radius_m * (n / (count - 1) - 0.5) for n in range(count)]
    return [(foot.forward_m + reach * math.sin(at), -shank.length_m + foot.radius_m - reach * math.cos(at)) for at in angles]


def mjcf(
    robot: Robot,
    rig: str,
    limits: "dict[str, dict[str, float]]",
    *,
    variation: Variation = Variation(),
    rotor_kg_m2: float = 0.0,
    friction_nm: float = 0.0,
    contact: bool = True,
    step_s: float = STEP_S,
) -> str:
    """The text of the model. ``limits``: as ``footfall.robot()`` gives them; ``rotor_kg_m2`` and ``friction_nm``: of a servo, at its joint.

    ``contact=False`` has no floor, for checks of the physics; ``step_s``: time step, s.
    """
    if rig not in RIGS:
        raise InputError(f"rig = '{rig}': allowed is one of {', '.join(RIGS)}")
    factor, friction = variation.mass_factor, variation.friction
    balls = "".join(f'<geom type="sphere" size="{_BALL_M}" pos="{x!r} 0 {z!r}"/>' for x, z in arc(robot.shank, robot.foot))

    shank = _shank(robot.shank, robot.foot, factor)

    def joint(name: str, axis: int) -> str:
        least, most = limits[name]["least_rad"] - _STOP_RAD, limits[name]["most_rad"] + _STOP_RAD
        return (
            f'<joint name="{name}" type="hinge" axis="0 {axis} 0" limited="true" range="{least!r} {most!r}" '
            f'armature="{rotor_kg_m2!r}" frictionloss="{friction_nm!r}"/>'
        )

    def leg(side: str, y: float) -> str:
        return (
            f'<body name="{side}_thigh" pos="0 {y} 0">{joint(f"{side}_hip", -1)}{_segment(robot.thigh, factor)}'
            f'<body name="{side}_shank" pos="0 0 {-robot.thigh.length_m!r}">{joint(f"{side}_knee", 1)}{shank}{balls}</body></body>'
        )

    # A hung trunk has its hip a quarter of a leg higher than one that stands.
    height = robot.hip_m * (1.25 if rig == "hung" else 1.0)
    lean = 0.0 if rig == "free" else math.radians(variation.pitch_deg)
    forward, up = (value / 1000.0 for value in variation.com_mm)
    slope = math.radians(variation.slope_deg)
    gravity = f"{-GRAVITY_M_S2 * math.sin(slope)!r} 0 {-GRAVITY_M_S2 * math.cos(slope)!r}"
    mass = robot.trunk.mass_kg * factor
    trunk = _inertial(mass, forward, robot.trunk.com_m + up, mass * robot.trunk.gyration_m**2)
    # MuJoCo takes the larger friction of the two that touch, so both have it. Its default for sparse systems has a known fault: dense.
    floor = '<geom name="floor" type="plane" size="0 0 1" contype="2" conaffinity="1"/>' if contact else ""
    return f"""<mujoco model="{robot.name} {rig}">
<compiler angle="radian" autolimits="false"/>
<option timestep="{step_s!r}" gravity="{gravity}" integrator="implicitfast" cone="elliptic"
  jacobian="dense" solver="Newton" iterations="100" tolerance="1e-10"/>
<default><geom friction="{friction!r} 0.005 0.0001" solref="0.01 1" contype="1" conaffinity="2" condim="3"/></default>
<worldbody>{floor}
<body name="trunk" pos="0 0 {height!r}" euler="0 {lean!r} 0">{_trunk(rig, lean)}{trunk}{leg("left", _APART_M)}{leg("right", -_APART_M)}</body>
</worldbody></mujoco>"""


def compiled(text: str) -> Any:
    """The model of MuJoCo of a text."""
    return mujoco().MjModel.from_xml_string(text)

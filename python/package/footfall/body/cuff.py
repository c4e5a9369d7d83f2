"""A servo on an orthosis joint that is strapped to a person's limb: the torque that it imposes on the limb.

The person is stronger than any servo: the limb moves as it was recorded, whatever the servo does. The orthosis has no mass but the servo's rotor.
All of it is simulation.
"""

from dataclasses import dataclass
from typing import Dict, List, Optional, Sequence, Tuple

import numpy as np
import numpy.typing as npt

from .. import JOINTS, robot as servo_maps
from .._errors import InputError
from .drivers import Frame
from .recorded import Motion, Path
from .seeds import Variation
from .simulation import mounted

Floats = npt.NDArray[np.float64]

#: Step of a joint with an elastic cuff, s.
STEP_S = 0.0002
#: Below this speed the friction of a gear that is moved by a rigid cuff fades, rad/s: at rest its direction is not known, and the torque without it
#: is the larger one.
_REST_RAD_S = 0.01
#: Damping of an elastic cuff as a share of the critical one with the rotor. Assumed: no source has it for a leg.
DAMPING_SHARE = 0.3
#: From the joint to the middle of its cuff, m, of a person of 1.75 m: two thirds of the thigh (0.43 m) and of the shank to the ankle (0.43 m).
LEVER_M: Dict[str, float] = {joint: 0.29 for joint in JOINTS}
#: Stiffness of elastic cuffs, N m/rad. 2.1 and 4.5 N/mm were measured across an upper arm (Schiebl et al., Sensors 25, 4605, 2025, doi
#: 10.3390/s25154605; nothing as complete was found for a leg): times the lever squared, 180 and 380. 30 stands for a loose strap.
CUFFS_NM_RAD = (30.0, 180.0, 380.0)


@dataclass(frozen=True)
class Supply:
    """The servos' supply from a time on."""

    at_s: float
    """When it is switched, s."""
    is_on: bool
    """No unit."""


@dataclass(frozen=True)
class Worn:
    """What the servos did to the limbs; rows at equal times, arrays of joints have the order of ``JOINTS``."""

    time_s: Floats
    """Shape (n,), s."""
    person_rad: Floats
    """The recorded angle of the limb, shape (n, 4), rad."""
    driven_rad: Floats
    """The angle of the orthosis, shape (n, 4), rad; that of the limb with a rigid cuff."""
    target_rad: Floats
    """The angle of the last pulse, shape (n, 4), rad; NaN before the first and without supply."""
    motor_nm: Floats
    """Torque of the motor at the shaft, shape (n, 4), N m."""
    limb_nm: Floats
    """Interaction torque: on the limb at its joint, positive towards flexion, shape (n, 4), N m."""


def wear(
    motion: Motion,
    frames: Sequence[Frame],
    supplies: Sequence[Supply],
    *,
    servo: str,
    supply_v: float,
    cuff_nm_rad: Optional[float] = None,
    robot_file: Optional[Path] = None,
    joints: Sequence[str] = tuple(JOINTS),
) -> Worn:
    """Moves the limbs along a motion, beside servos that take pulses (``frames``; times s, widths us) and lose their supply.

    ``cuff_nm_rad``: stiffness of the cuffs at the joint, N m/rad; without it they are rigid. The orthosis begins where the limb is. Servos begin with a
    supply of ``supply_v``, V; ``supplies`` are in the order of their times. Only ``joints`` are computed, the others are 0.
    """
    if cuff_nm_rad is not None and not 1.0 <= cuff_nm_rad <= 2000.0:
        raise InputError(f"stiffness of the cuff = {cuff_nm_rad} N m/rad: allowed is 1 to 2000 N m/rad, or none for a rigid one")
    count, step_s = len(motion.time_s), float(motion.time_s[1] - motion.time_s[0])
    maps = servo_maps(robot_file)
    driven, target = motion.rad.copy(), np.full((count, 4), np.nan)
    motor, limb = np.zeros((count, 4)), np.zeros((count, 4))
    for name in joints:
        place = JOINTS.index(name)
        one = mounted(servo, supply_v, maps[name], Variation(), 0.0)
        widths = [(frame.time_s, frame.us[place]) for frame in frames if not np.isnan(frame.us[place])]
        happens: List[Tuple[float, Optional[bool], float]] = [(at_s + us / 1e6, None, us) for at_s, us in widths]
        happens = sorted(happens + [(supply.at_s, supply.is_on, 0.0) for supply in supplies], key=lambda event: event[0])
        inertia, friction = one.servo.rotor_kg_m2, one.servo.friction_nm
        stiffness = cuff_nm_rad or 0.0
        damping = 2.0 * DAMPING_SHARE * (stiffness * inertia) ** 0.5
        times, angles, speeds = motion.time_s.tolist(), motion.rad[:, place].tolist(), motion.rad_s[:, place].tolist()
        accelerations = motion.rad_s2[:, place].tolist()
        angle, speed, goal, torques, next_, powered = angles[0], speeds[0], np.nan, [0.0] * count, 0, True
        driven_column, goals, motors = [0.0] * count, [0.0] * count, [0.0] * count
        for row, now in enumerate(times):
            while next_ < len(happens) and happens[next_][0] <= now + 1e-9:
                at_s, switch, us = happens[next_]
                next_ += 1
                if switch is not None:
                    one.servo.set_supply(supply_v if switch else 0.0)
                    # A servo that loses its supply forgets its last pulse, and takes none.
                    powered, goal = switch, goal if switch else np.nan
                else:
                    one.servo.pulse(at_s, us)
                    goal = one.target(us) if powered else np.nan
            if cuff_nm_rad is None:
                angle, speed = angles[row], speeds[row]
                torque = one.torque(now, angle, speed)
                rub = friction * min(1.0, max(-1.0, speed / _REST_RAD_S))
                torques[row] = torque - rub - inertia * accelerations[row]
            else:
                torque = one.torque(now, angle, speed)
                torques[row] = stiffness * (angle - angles[row]) + damping * (speed - speeds[row])
            driven_column[row], goals[row], motors[row] = angle, goal, torque
            if cuff_nm_rad is not None:
                # The cuff's damping is implicit, the dry friction exact: it takes speed, and never turns it round.
                ahead = speed + step_s / inertia * (torque + stiffness * (angles[row] - angle) + damping * speeds[row])
                ahead /= 1.0 + step_s * damping / inertia
                most = step_s * friction / inertia / (1.0 + step_s * damping / inertia)
                speed = max(0.0, ahead - most) if ahead > 0.0 else min(0.0, ahead + most)
                angle += step_s * speed
        driven[:, place], target[:, place], motor[:, place], limb[:, place] = driven_column, goals, motors, torques
    return Worn(motion.time_s, motion.rad, driven, target, motor, limb)

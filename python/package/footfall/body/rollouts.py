"""Many runs at once in MuJoCo's own loop, for searches: the servos are actuators of the model, and the pulses do not depend on the body.

Several times as fast as ``run``, which asks each servo from Python; a test holds both to the same way. What it leaves out: the first two
milliseconds, in which a servo has no pulse yet, and that an analogue servo fades where two pulses come more than 20 ms apart.
"""

from dataclasses import dataclass
from importlib import import_module
from typing import Any, List, Sequence

import numpy as np
import numpy.typing as npt

from .. import JOINTS
from .._errors import InputError
from .drivers import Frame
from .measures import FALLEN_RAD, FALLEN_SHARE, RAMP_S
from .simulation import PUSH_AT_S, PUSH_S, Body

Floats = npt.NDArray[np.float64]

#: Runs that have fallen are left out after each part of a run, of so many milliseconds.
_PART = 500
#: The damping of a held lean, as a share of its stiffness, s.
_HOLD_DAMPING_S = 0.06


@dataclass(frozen=True)
class Outcome:
    """What came of one run. Units are in the names."""

    metres: float
    """Way, m."""
    seconds: float
    """Until the fall, or the whole time, s."""
    fallen: bool
    """No unit."""
    torque_share: float
    """Root mean square of the motor torque of the joint with the largest, as a share of the stall torque; no unit."""


@dataclass(frozen=True)
class Ride:
    """One run that is asked for. Units are in the names."""

    body: Body
    """As it stands before its first pulse; the run does not change it."""
    frames: Sequence[Frame]
    """Servo frames, the first at 0 s."""
    push_ns: float = 0.0
    """Push as in ``run``, N s."""
    hold_nm: float = 0.0
    """Stiffness of a spring that holds the lean of a body on the rig ``free``, with a damper, N m for 1 rad."""


def model(ride: Ride, module: Any, *, foot: bool = False) -> Any:
    """The model of a body with two actuators for each servo, one beyond either edge of its dead band, and one for the push.

    ``foot``: with a sensor of the normal force at the left foot, N.
    """
    body = ride.body
    if not all(mounted.servo.stall_nm for mounted in body.servos):
        raise InputError("supply = 0 V: allowed is one of the servo's data sheet; without a supply nothing moves the legs")
    spec = module.MjSpec.from_string(body.text)
    trunk = spec.body("trunk")
    trunk.add_site(name="push", pos=body.model.body("trunk").ipos.tolist())
    spec.worldbody.add_site(name="floor")
    for joint, mounted in zip(JOINTS, body.servos):
        for side in (1.0, -1.0):
            one = spec.add_actuator(name=f"{joint} {side:+.0f}", target=joint, trntype=module.mjtTrn.mjTRN_JOINT)
            one.gaintype, one.biastype = module.mjtGain.mjGAIN_FIXED, module.mjtBias.mjBIAS_AFFINE
            one.gainprm[0] = mounted.stiffness_nm
            one.biasprm[0], one.biasprm[1] = -side * mounted.stiffness_nm * mounted.dead_rad, -mounted.stiffness_nm
            one.forcelimited = 1
            one.forcerange = sorted((0.0, side * mounted.servo.stall_nm))
    push = spec.add_actuator(name="push", target="push", refsite="floor", trntype=module.mjtTrn.mjTRN_SITE)
    push.gear = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    if foot:
        arc = body.robot.foot
        middle = [arc.forward_m, 0.0, arc.radius_m - body.robot.shank.length_m]
        # Contacts within a ball about the middle of the arc, and a little beyond it.
        spec.body("left_shank").add_site(name="left_foot", pos=middle, size=[1.2 * arc.radius_m] * 3)
        spec.add_sensor(name="left_foot", type=module.mjtSensor.mjSENS_TOUCH, objtype=module.mjtObj.mjOBJ_SITE, objname="left_foot")
    built = spec.compile()
    for place, mounted in zip(body.speed_places, body.servos):
        built.dof_damping[place] = mounted.servo.stall_nm / mounted.servo.no_load_rad_s
    if ride.hold_nm and body.rig == "free":
        lean = built.joint("pitch")
        lean.stiffness, lean.damping = ride.hold_nm, ride.hold_nm * _HOLD_DAMPING_S
    return built


def _controls(ride: Ride, ticks: int) -> Floats:
    """What the actuators get at each millisecond: angles of the last pulses with trim (rad), and the push (N); shape (ticks, 9)."""
    found = np.zeros((ticks, 2 * len(JOINTS) + 1))
    starts, widths = np.array([frame.time_s for frame in ride.frames]), np.array([frame.us for frame in ride.frames])
    for place, mounted in enumerate(ride.body.servos):
        # A servo knows the width of a pulse at its end.
        ends = np.ceil((starts + widths[:, place] / 1e6) * 1000.0 - 1e-6)
        last = np.maximum(np.searchsorted(ends, np.arange(ticks), side="right") - 1, 0)
        angles = np.array([mounted.target(us) - mounted.trim_rad for us in widths[:, place]])
        found[:, 2 * place] = found[:, 2 * place + 1] = angles[last]
    time_s = np.arange(ticks) / 1000.0
    found[:, -1] = np.where((time_s >= PUSH_AT_S) & (time_s < PUSH_AT_S + PUSH_S), ride.push_ns / PUSH_S, 0.0)
    return found


def outcomes(rides: Sequence[Ride], seconds: float) -> List[Outcome]:
    """The outcome of each of some runs of a time, s, on one kind of rig, ``boom`` or ``free``."""
    module, rollout = import_module("mujoco"), import_module("mujoco.rollout")
    ticks = round(seconds * 1000.0)
    models = [model(ride, module) for ride in rides]
    full = module.mjtState.mjSTATE_FULLPHYSICS
    states = np.zeros((len(rides), module.mj_stateSize(models[0], full)))
    data = module.MjData(models[0])
    for state, one, ride in zip(states, models, rides):
        module.mj_resetData(one, data)
        data.qpos[:] = ride.body.data.qpos
        module.mj_getState(one, data, state, full)
    controls = np.array([_controls(ride, ticks) for ride in rides])
    # A state is the time, then positions and speeds.
    first = rides[0].body
    at, rates = 1 + first.angle_places, 1 + models[0].nq + first.speed_places
    ways = {name: 1 + place for name, place in first.trunk_places.items()}
    laws = np.array([[(one.servo.stall_nm, one.stiffness_nm, one.dead_rad) for one in ride.body.servos] for ride in rides])
    no_load = first.servos[0].servo.no_load_rad_s
    least_m = (FALLEN_SHARE - 1.0) * first.robot.hip_m
    metres, ends, fallen = np.zeros(len(rides)), np.full(len(rides), seconds), np.zeros(len(rides), dtype=bool)
    squares, counts = np.zeros((len(rides), len(JOINTS))), np.zeros(len(rides))
    up = np.arange(len(rides))
    with rollout.Rollout(nthread=0) as pool:
        for begin in range(0, ticks, _PART):
            control = controls[up, begin : begin + _PART]
            states, _ = pool.rollout([models[one] for one in up], data, states, control)
            lies = states[:, :, ways["z"]] < least_m
            if "pitch" in ways:
                lies |= np.abs(states[:, :, ways["pitch"]]) > FALLEN_RAD
            falls, count = lies.any(axis=1), lies.shape[1]
            last = np.where(falls, lies.argmax(axis=1), count - 1)
            metres[up] = states[np.arange(len(up)), last, ways["x"]]
            ends[up], fallen[up] = (begin + last + 1) / 1000.0, falls
            if begin >= round(RAMP_S * 1000.0):
                stall, stiffness, dead = (laws[up][:, None, :, part] for part in range(3))
                error = control[:, :, :-1:2] - states[:, :, at]
                drive = np.sign(error) * np.minimum(np.maximum(np.abs(error) - dead, 0.0) * stiffness / stall, 1.0)
                share = drive - states[:, :, rates] / no_load
                used = np.arange(count) <= last[:, None]
                squares[up] += (np.square(share) * used[:, :, None]).sum(axis=1)
                counts[up] += used.sum(axis=1)
            up, states = up[~falls], states[~falls, -1]
            if not len(up):
                break
    shares = np.sqrt(squares.max(axis=1) / np.maximum(counts, 1.0))
    found = zip(metres.tolist(), ends.tolist(), fallen.tolist(), shares.tolist())
    return [Outcome(*one) for one in found]

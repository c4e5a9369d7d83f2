"""One run: servo frames drive the servos, the servos the body, and the body's joints the sensors; 1 ms a step."""

import math
import os
from dataclasses import dataclass
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt

from .. import JOINTS, Servo, robot as servo_maps
from .._errors import InputError
from ._extra import mujoco
from .drivers import Driver, Frame
from .model import STEP_S, compiled, mjcf
from .robots import Robot
from .seeds import Variation
from .sensor import DEFAULT_SENSORS, Sensors

Path = Union[str, "os.PathLike[str]"]
Floats = npt.NDArray[np.float64]

#: When a push begins, and how long it lasts, s.
PUSH_AT_S, PUSH_S = 5.0, 0.1


@dataclass(frozen=True)
class Trace:
    """What happened, one row a millisecond from the first servo frame on; arrays of joints have the order of ``JOINTS``."""

    robot: Robot
    rig: str
    """No unit."""
    time_s: Floats
    """Shape (n,), s."""
    trunk: Floats
    """Way forwards (m), height of the hip over that of a straight leg (m), lean forwards (rad); shape (n, 3)."""
    angles_rad: Floats
    """Shape (n, 4), rad."""
    speeds_rad_s: Floats
    """Shape (n, 4), rad/s."""
    targets_rad: Floats
    """Angles of the last pulses, shape (n, 4), rad."""
    motor_nm: Floats
    """Torque of the motors at the shaft, before rotor and friction, shape (n, 4), N m."""
    output_nm: Floats
    """Torque on the leg, after rotor and friction, shape (n, 4), N m."""
    load_n: Floats
    """Normal force of each foot, left and right, shape (n, 2), N."""
    slide_m: Floats
    """Way that a loaded foot slid on the floor in the step, left and right, shape (n, 2), m."""
    pulses_us: Floats
    """Widths of the servo frames, shape (frames, 4), us."""
    mass_kg: float
    """Of this body, kg."""
    slope_deg: float = 0.0
    """Of the floor, upwards; lengths and angles of the trace are those of the floor, deg."""


@dataclass(frozen=True)
class _Mounted:
    """A servo on its joint."""

    servo: Servo
    neutral_us: float
    at_neutral_rad: float
    us_per_rad: float
    trim_rad: float
    sign: float
    stiffness_nm: float
    """Within the proportional band, N m for 1 rad."""
    dead_rad: float
    """From the middle of the dead band to its edge, rad."""

    def torque(self, time_s: float, angle: float, speed: float) -> float:
        """Torque on the joint, N m."""
        shaft = ((self.neutral_us - 1500.0) + (angle + self.trim_rad - self.at_neutral_rad) * self.us_per_rad) / abs(self.us_per_rad)
        return self.sign * self.servo.torque(time_s, shaft, self.sign * speed)

    def target(self, us: float) -> float:
        """The joint's angle of a pulse, without trim, rad."""
        return self.at_neutral_rad + (us - self.neutral_us) / self.us_per_rad


def mounted(name: str, supply_v: float, one: Dict[str, float], variation: Variation, trim_rad: float) -> _Mounted:
    """A servo by its name at a supply, V, on a joint with this entry of the servo map, as ``footfall.robot()`` gives it, and an error of its neutral, rad."""
    scale, band = one["us_per_rad"], variation.band_deg
    built, probe = (Servo(name, supply_v=supply_v, us_per_rad=abs(scale), band_deg=band, stall_factor=variation.stall_factor) for _ in range(2))
    stiffness = built.stall_nm / math.radians(band)
    # At an error of half of the band, which is beyond the dead band. Without a supply there is no torque at all.
    error = math.radians(band) / 2.0
    probe.pulse(0.0, 1500.0 + error * abs(scale))
    dead = error - probe.torque(0.0, 0.0, 0.0) / stiffness if stiffness else 0.0
    return _Mounted(built, one["neutral_us"], one["at_neutral_rad"], scale, trim_rad, math.copysign(1.0, scale), stiffness, dead)


class Body:
    """A robot on a rig, with servos at its joints. ``robot_file``: servo map and limits; ``servo``: another one than the robot's, by name."""

    def __init__(
        self,
        robot: Robot,
        rig: str,
        *,
        variation: Variation = Variation(),
        servo: Optional[str] = None,
        supply_v: Optional[float] = None,
        robot_file: Optional[Path] = None,
        step_s: float = STEP_S,
    ) -> None:
        name = servo or robot.servo
        if not name:
            raise InputError(f"robot = '{robot.name}': no modelled servo moves it; allowed is `size`, which asks for its torque")
        self._module = mujoco()
        maps = servo_maps(robot_file)
        volts = robot.supply_v if supply_v is None else supply_v
        self.servos: List[_Mounted] = []
        for place, joint in enumerate(JOINTS):
            self.servos.append(mounted(name, volts, maps[joint], variation, math.radians(variation.trim_deg[place])))
        self.robot, self.rig, self.step_s, self.slope_deg = robot, rig, step_s, variation.slope_deg
        first = self.servos[0].servo
        self._friction_nm, self._rotor = first.friction_nm, first.rotor_kg_m2
        self.text = mjcf(robot, rig, maps, variation=variation, rotor_kg_m2=self._rotor, friction_nm=self._friction_nm, step_s=step_s)
        self.model: Any = compiled(self.text)
        self.data: Any = self._module.MjData(self.model)
        joints = [self.model.joint(joint) for joint in JOINTS]
        # Places in the arrays of MuJoCo; numpy's integers, so that they index arrays.
        self.angle_places = np.array([joint.qposadr[0] for joint in joints])
        self.speed_places = np.array([joint.dofadr[0] for joint in joints])
        self._feet = [self.model.body(f"{side}_shank").id for side in ("left", "right")]
        # Place of the foot of each geom; the floor, which is of no foot, adds nothing.
        self._foot_of = [self._feet.index(one) if one in self._feet else 0 for one in self.model.geom_bodyid.tolist()]
        self._force, self._jacobian, self._rub = np.zeros(6), np.zeros((3, self.model.nv)), np.zeros(self.model.nv)
        free = {"hung": (), "boom": ("x", "z"), "free": ("x", "z", "pitch")}[rig]
        self.trunk_places = {name: self.model.joint(name).qposadr[0] for name in free}
        self.park_rad = [maps[joint]["park_rad"] for joint in JOINTS]
        pose = [maps[joint]["park_rad"] + math.radians(variation.pose_deg[place]) for place, joint in enumerate(JOINTS)]
        self._held_lean = 0.0 if rig == "free" else math.radians(variation.pitch_deg)
        self._stand(pose, math.radians(variation.pitch_deg))

    def _stand(self, pose: Sequence[float], pitch: float) -> None:
        """The first pose, with the lower foot on the floor."""
        self.data.qpos[self.angle_places] = pose
        if "pitch" in self.trunk_places:
            self.data.qpos[self.trunk_places["pitch"]] = pitch
        self._module.mj_forward(self.model, self.data)
        if "z" in self.trunk_places:
            balls = self.model.geom_type == self._module.mjtGeom.mjGEOM_SPHERE
            self.data.qpos[self.trunk_places["z"]] -= float((self.data.geom_xpos[balls, 2] - self.model.geom_size[balls, 0]).min())
            self._module.mj_forward(self.model, self.data)

    @property
    def angles(self) -> Floats:
        """Angles of the joints, rad, shape (4,)."""
        values: Floats = self.data.qpos[self.angle_places]
        return values

    def pulse(self, joint: int, ended_s: float, us: float) -> None:
        """Gives the servo of a joint, by its place in ``JOINTS``, a pulse (us) that ends at a time (s)."""
        self.servos[joint].servo.pulse(ended_s, us)

    def step(self, time_s: float, push_n: float = 0.0) -> Tuple[Floats, Floats]:
        """Goes on by a step, with a push (N, forwards) at the trunk's centre of mass; the torques of the motors and on the legs, N m, shape (4,)."""
        data, module = self.data, self._module
        angles, speeds = data.qpos[self.angle_places].tolist(), data.qvel[self.speed_places].tolist()
        motor = np.array([servo.torque(time_s, angle, speed) for servo, angle, speed in zip(self.servos, angles, speeds)])
        data.qfrc_applied[self.speed_places] = motor
        data.xfrc_applied[1, 0] = push_n
        module.mj_step(self.model, data)
        # Rows of the constraints: equality, friction, then limits and contacts.
        rows = slice(data.ne, data.ne + data.nf)
        rub = self._rub
        rub[:] = 0.0
        rub[data.efc_id[rows]] = data.efc_force[rows]
        return motor, motor + rub[self.speed_places] - self._rotor * data.qacc[self.speed_places]

    def feet(self) -> Tuple[List[float], List[float]]:
        """Normal force (N) of each foot, and the way (m) that its lowest point slid in the last step if it is loaded."""
        data, module = self.data, self._module
        load, slide, deepest = [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]
        force, jacobian = self._force, self._jacobian
        for index in range(data.ncon):
            contact = data.contact[index]
            foot = self._foot_of[int(contact.geom1)] + self._foot_of[int(contact.geom2)]
            module.mj_contactForce(self.model, data, index, force)
            load[foot] += float(force[0])
            dist = float(contact.dist)
            if force[0] > 0.0 and dist < deepest[foot]:
                deepest[foot] = dist
                module.mj_jac(self.model, data, jacobian, None, contact.pos, self._feet[foot])
                slide[foot] = abs(float(jacobian[0] @ data.qvel)) * self.step_s
        return load, slide

    def trunk(self) -> Tuple[float, float, float]:
        """Way forwards (m), height of the hip over that of a straight leg (m), lean forwards (rad)."""
        at = {name: float(self.data.qpos[place]) for name, place in self.trunk_places.items()}
        return at.get("x", 0.0), at.get("z", 0.0), at.get("pitch", self._held_lean)


#: Pulses at which two servo maps are compared, us; maps are straight lines, and angles that differ by less are equal, deg.
_COMPARED_US, _SAME_DEG = (1000.0, 2000.0), 0.01


def _same_maps(body: Body, driver: Driver) -> None:
    """Refuses a driver whose pulses the servos of the body would take for other angles."""
    joint_angles = getattr(driver, "joint_angles", None)
    if joint_angles is None:
        return
    sent = np.degrees(joint_angles([[us] * len(JOINTS) for us in _COMPARED_US])).T.tolist()
    for joint, servo, asked in zip(JOINTS, body.servos, sent):
        done = [math.degrees(servo.target(us)) for us in _COMPARED_US]
        if max(abs(one - other) for one, other in zip(asked, done)) > _SAME_DEG:
            least, most = (f"{us:g} us" for us in _COMPARED_US)
            raise InputError(
                f"servo map of {joint}: in the control loop {least} is {asked[0]:.2f} deg and {most} is {asked[1]:.2f} deg, on the body {done[0]:.2f} and "
                f"{done[1]:.2f} deg; allowed is one map for both: --robot-file, or `robot_file` of Body, of the robot whose file or record the loop has"
            )


def run(
    body: Body,
    driver: Driver,
    seconds: float,
    *,
    seed: int = 0,
    sensors: Sequence[Tuple[str, Optional[Path]]] = DEFAULT_SENSORS,
    until: Optional[Callable[[Body], bool]] = None,
    push_ns: float = 0.0,
    exchange_ms: int = 1,
) -> Trace:
    """Runs a body with a driver for a time, s, from the first servo frame on; the body is held in its first pose until then.

    ``until``: ends the run early where it is true, asked each millisecond. ``seed``: of the noise of the sensors. ``push_ns``: impulse of a push at
    the trunk's centre of mass, forwards, N s, spread over ``PUSH_S`` from ``PUSH_AT_S`` on. ``exchange_ms``: how far the driver goes at once, ms: it has
    the volts at the beginning of that time, and its pulses come to the servos at their own times.
    """
    if not 0.1 <= seconds <= 3600.0:
        raise InputError(f"seconds = {seconds}: allowed is 0.1 to 3600 s")
    ticks = round(seconds * 1000.0)
    substeps = round(0.001 / body.step_s)
    if substeps < 1 or abs(substeps * body.step_s - 0.001) > 1e-12:
        raise InputError(f"step_s = {body.step_s}: allowed is a whole part of 0.001 s, the control period")
    if body.data.time > 0.0:
        raise InputError("the body has moved already, and would go on from there; allowed is a new Body for each run")
    _same_maps(body, driver)
    volts = Sensors(sensors, seed)
    columns: List[List[Any]] = [[] for _ in range(8)]
    pulses: List[Tuple[float, ...]] = []
    if not 1 <= exchange_ms <= 20:
        raise InputError(f"exchange_ms = {exchange_ms}: allowed is 1 to 20 ms, a servo frame")
    frames: List[Frame] = driver.arm(volts.volts(body.angles.tolist()))
    waiting: List[Tuple[float, int, float]] = []
    targets = body.angles.tolist()
    for tick in range(ticks):
        if tick % exchange_ms == 0:
            frames += driver.step(1000 * min(exchange_ms, ticks - tick), volts.volts(body.angles.tolist()))
        for frame in [one for one in frames if one.time_s <= tick / 1000.0]:
            pulses.append(frame.us)
            waiting += [(frame.time_s + us / 1e6, joint, us) for joint, us in enumerate(frame.us)]
        frames = [one for one in frames if one.time_s > tick / 1000.0]
        # A servo knows the width of a pulse at its end.
        for ended_s, joint, us in [pulse for pulse in waiting if pulse[0] <= tick / 1000.0]:
            body.pulse(joint, ended_s, us)
            targets[joint] = body.servos[joint].target(us)
        waiting = [pulse for pulse in waiting if pulse[0] > tick / 1000.0]
        motor, output, slid = np.zeros(4), np.zeros(4), [0.0, 0.0]
        for part in range(substeps):
            time_s = tick / 1000.0 + part * body.step_s
            is_pushed = PUSH_AT_S <= time_s < PUSH_AT_S + PUSH_S
            motor, output = body.step(time_s, push_ns / PUSH_S if is_pushed else 0.0)
            load, slide = body.feet()
            slid = [sum(pair) for pair in zip(slid, slide)]
        row = (body.trunk(), body.angles, body.data.qvel[body.speed_places].copy(), tuple(targets), motor, output, load, slid)
        for column, value in zip(columns, row):
            column.append(value)
        if until is not None and until(body):
            break
    trunk, angles, speeds, goals, motors, outputs, loads, slides = (np.array(column, dtype=np.float64) for column in columns)
    times_s = (np.arange(len(trunk)) + 1) / 1000.0
    mass = float(body.model.body_mass.sum())
    widths = np.array(pulses, dtype=np.float64)
    return Trace(
        body.robot, body.rig, times_s, trunk, angles, speeds, goals, motors, outputs, loads, slides, widths, mass, slope_deg=body.slope_deg
    )

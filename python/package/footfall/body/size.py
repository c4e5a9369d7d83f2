"""How strong and how fast servos have to be for a gait: of a run, or of a person's legs that are moved along the gait."""

from typing import Any, Dict, List, Tuple

import numpy as np

from .. import JOINTS, Generator, Servo, robot as servo_maps, servos
from ._extra import mujoco
from .model import STEP_S, compiled, mjcf
from .robots import Robot
from .seeds import Variation
from .simulation import Trace

#: Shares of the time for which the torque and the speed are enough.
SHARES = (95.0, 100.0)
#: Left out at the start, s: the ramp from the park pose, or the transient of the generator.
_FROM_S = 0.5
#: Of the whole supply: the motor's torque is rounded.
_FULL = 0.999
_OF_A_RUN = "a run with each, the body's masses as they are; no fall, and each joint within 5 degrees rms of its pulses"
_OF_A_MOTION = "its torque at the speed moves the leg, its rotor and its gear for 95 % of the time at every joint"


def _shares(torques_nm: Any, speeds_rad_s: Any) -> List[Dict[str, Any]]:
    """For each joint, the torque (N m) and the speed (deg/s) that are enough for 95 and 100 % of the time."""
    rows = []
    for place, joint in enumerate(JOINTS):
        row: Dict[str, Any] = {"joint": joint}
        for share in SHARES:
            row[f"torque_{share:.0f}_nm"] = float(np.percentile(np.abs(torques_nm[:, place]), share))
            row[f"speed_{share:.0f}_deg_s"] = float(np.degrees(np.percentile(np.abs(speeds_rad_s[:, place]), share)))
        rows.append(row)
    return rows


def of_traces(traces: List[Trace]) -> List[Dict[str, Any]]:
    """Of runs: torque on the legs (N m) and speed (deg/s) of each joint, over all of them."""
    late = [trace.time_s > _FROM_S for trace in traces]
    torques = np.concatenate([trace.output_nm[rows] for trace, rows in zip(traces, late)])
    speeds = np.concatenate([trace.speeds_rad_s[rows] for trace, rows in zip(traces, late)])
    return _shares(torques, speeds)


def full_drive(trace: Trace, servo: Servo) -> List[float]:
    """For each joint, the share of the time in which the motor gets its whole supply; no unit."""
    drive = trace.motor_nm / servo.stall_nm + trace.speeds_rad_s / servo.no_load_rad_s
    return [float(share) for share in (np.abs(drive[trace.time_s > _FROM_S]) > _FULL).mean(axis=0)]


def suffices(servo: Servo, traces: List[Trace], all_runs: Dict[str, Any]) -> Dict[str, Any]:
    """Whether a servo is enough for the runs that it was in: no fall, and each joint is within the proportional band of its pulses (rms, deg)."""
    shares = [max(one) for one in zip(*(full_drive(trace, servo) for trace in traces))]
    return {
        "servo": servo.name,
        "supply_v": servo.supply_v,
        "suffices": all_runs["falls"] == 0 and max(all_runs["tracking_rms_deg"]) <= Variation().band_deg,
        "full_drive_share": shares,
        "metres": all_runs["metres_mean"],
        "falls": all_runs["falls"],
        "tracking_rms_deg": all_runs["tracking_rms_deg"],
    }


def table(found: List[Dict[str, Any]]) -> List[str]:
    """Lines of text: torque (N m) and speed (deg/s) of each joint, then each class of servos; ``found`` as the command line has it."""
    width = max(len(one["gait"]) for one in found) + 2
    lines = [f"{'':{width}}{'':7}{'':12}{'torque N m':>18}{'speed deg/s':>18}"]
    lines.append(f"{'gait':{width}}{'speed':7}{'joint':12}{'95 %':>9}{'100 %':>9}{'95 %':>9}{'100 %':>9}")
    for one in found:
        for row in one["joints"]:
            torques = f"{row['torque_95_nm']:9.3f}{row['torque_100_nm']:9.3f}"
            lines.append(f"{one['gait']:{width}}{one['speed']:<7g}{row['joint']:12}{torques}{row['speed_95_deg_s']:9.0f}{row['speed_100_deg_s']:9.0f}")
    if not found[0]["servos"]:
        return lines
    is_run = "metres" in found[0]["servos"][0]
    lines += ["", "is a class of servos enough: " + (_OF_A_RUN if is_run else _OF_A_MOTION)]
    what = f"{'way m':>8}{'falls':>7}{'full drive %':>14}{'error deg':>11}" if is_run else f"{'within %':>10}"
    lines.append(f"{'gait':{width}}{'speed':7}{'servo':10}{'supply V':>9}{'enough':>8}{what}")
    for one in found:
        for servo in one["servos"]:
            cells = f"{one['gait']:{width}}{one['speed']:<7g}{servo['servo']:10}{servo['supply_v']:9g}{'yes' if servo['suffices'] else 'no':>8}"
            if is_run:
                cells += f"{servo['metres']:8.2f}{servo['falls']:7}{100.0 * max(servo['full_drive_share']):14.1f}{max(servo['tracking_rms_deg']):11.2f}"
            else:
                cells += f"{100.0 * min(servo['within_share']):10.1f}"
            lines.append(cells)
        if one["walks_why_not"]:
            lines.append(f"{'':{width}}none is enough: the gate limits {100.0 * one['limited_share']:.1f} % of the control periods, {one['walks_why_not']}")
    return lines


def by_inverse_dynamics(robot: Robot, generator: Generator, seconds: float) -> Tuple[List[Dict[str, Any]], List[Dict[str, Any]]]:
    """Of legs that hang from a fixed trunk and move exactly as a generator says: torque (N m) and speed (deg/s) of each joint, and each servo.

    No servo, no floor, no muscle: what a drive on a passive leg needs in the air, for a time in s. For each class of servos, the share of the time in
    which its torque at that speed is enough for the leg, its own rotor and the friction of its gear. A step of the generator is 1 ms of the motion.
    """
    module = mujoco()
    model = compiled(mjcf(robot, "hung", servo_maps(), contact=False))
    data = module.MjData(model)
    places = np.array([model.joint(joint).qposadr[0] for joint in JOINTS])
    angles = generator.run((_FROM_S + seconds) * generator.period_s / STEP_S).angles_rad.astype(np.float64)
    speeds = np.gradient(angles, STEP_S, axis=0)
    accelerations = np.gradient(speeds, STEP_S, axis=0)
    rows = range(round(_FROM_S / STEP_S), len(angles) - 1)
    torques = np.zeros((len(rows), 4))
    for row, at in enumerate(rows):
        data.qpos[places], data.qvel[places], data.qacc[places] = angles[at], speeds[at], accelerations[at]
        module.mj_inverse(model, data)
        torques[row] = data.qfrc_inverse[places]
    late = slice(rows.start, rows.stop)
    return _shares(torques, speeds[late]), [_within(name, torques, speeds[late], accelerations[late]) for name in servos()]


def _within(name: str, torques_nm: Any, speeds_rad_s: Any, accelerations_rad_s2: Any) -> Dict[str, Any]:
    """Whether a servo's torque is enough for 95 % of the time at every joint."""
    servo = Servo(name, supply_v=Servo(name, supply_v=0.0).supply_range_v[1])
    needed = torques_nm + servo.rotor_kg_m2 * accelerations_rad_s2 + servo.friction_nm * np.sign(speeds_rad_s)
    # A motor that brakes has the torque of its speed besides.
    share = [float(one) for one in (np.abs(needed / servo.stall_nm + speeds_rad_s / servo.no_load_rad_s) <= 1.0).mean(axis=0)]
    return {"servo": name, "supply_v": servo.supply_v, "suffices": min(share) >= SHARES[0] / 100.0, "within_share": share}

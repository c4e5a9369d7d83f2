"""How strong and how fast servos have to be for a gait: of a run, or of a person's legs that are moved along the gait."""

from typing import Any, Dict, List

import numpy as np

from .. import JOINTS, Generator, robot as servo_maps
from ._extra import mujoco
from .model import STEP_S, compiled, mjcf
from .robots import Robot
from .simulation import Trace

#: Shares of the time for which the torque and the speed are enough.
SHARES = (95.0, 100.0)
#: Left out at the start, s: the ramp from the park pose, or the transient of the generator.
_FROM_S = 0.5


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


def by_inverse_dynamics(robot: Robot, generator: Generator, seconds: float) -> List[Dict[str, Any]]:
    """Of legs that hang from a fixed trunk and move exactly as a generator says: torque (N m) and speed (deg/s) of each joint.

    No servo, no floor, no muscle: what a drive on a passive leg needs in the air, for a time in s.
    """
    module = mujoco()
    model = compiled(mjcf(robot, "hung", servo_maps(), contact=False))
    data = module.MjData(model)
    places = np.array([model.joint(joint).qposadr[0] for joint in JOINTS])
    angles = generator.run(_FROM_S + seconds).angles_rad.astype(np.float64)
    speeds = np.gradient(angles, STEP_S, axis=0)
    accelerations = np.gradient(speeds, STEP_S, axis=0)
    rows = range(round(_FROM_S / STEP_S), len(angles) - 1)
    torques = np.zeros((len(rows), 4))
    for row, at in enumerate(rows):
        data.qpos[places], data.qvel[places], data.qacc[places] = angles[at], speeds[at], accelerations[at]
        module.mj_inverse(model, data)
        torques[row] = data.qfrc_inverse[places]
    return _shares(torques, speeds[rows.start : rows.stop])

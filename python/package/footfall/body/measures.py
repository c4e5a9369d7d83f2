"""What a run shows: metres, steps, falls, slip, torque and speed."""

import hashlib
import math
from typing import Any, Dict, List, Sequence

import numpy as np
import numpy.typing as npt

from .. import JOINTS
from .simulation import Body, Trace

#: A body has fallen if its hip is below this share of its height with straight legs.
FALLEN_SHARE = 0.6
#: Or if its trunk leans by more, rad.
FALLEN_RAD = math.radians(45.0)
#: A foot is loaded with more than this share of the weight.
_LOADED_SHARE = 0.05
#: A step is a load after so many milliseconds without one.
_SWING_MS = 50
#: The first half second is left out of torque, speed and error: the ramp from the park pose.
RAMP_S = 0.5


def fallen(body: Body) -> bool:
    """Whether a body lies on the floor, or is about to; no unit."""
    _, height, lean = body.trunk()
    return body.rig != "hung" and (height < (FALLEN_SHARE - 1.0) * body.robot.hip_m or abs(lean) > FALLEN_RAD)


def _steps(loaded: npt.NDArray[np.bool_]) -> int:
    """Touchdowns of one foot."""
    count, air = 0, 0
    for down in loaded.tolist():
        if down:
            count += air >= _SWING_MS
            air = 0
        else:
            air += 1
    return count


def measures(trace: Trace, has_fallen: bool) -> Dict[str, Any]:
    """The numbers of one run; their names have the units. Lists have the order of ``JOINTS``. All of it is simulation."""
    loaded = trace.load_n > _LOADED_SHARE * trace.mass_kg * 9.81
    way = float(trace.trunk[-1, 0])
    slid = float(trace.slide_m.sum())
    late = trace.time_s > min(RAMP_S, trace.time_s[-1] / 2.0)
    output, motor, speed = np.abs(trace.output_nm[late]), np.abs(trace.motor_nm[late]), np.degrees(np.abs(trace.speeds_rad_s[late]))
    error = np.degrees(trace.angles_rad - trace.targets_rad)[late]

    def rms(values: Any) -> List[float]:
        return [float(value) for value in np.sqrt(np.mean(np.square(values), axis=0))]

    def peak(values: Any) -> List[float]:
        return [float(value) for value in values.max(axis=0)]

    return {
        "seconds": float(trace.time_s[-1]),
        "metres": way,
        "steps": sum(_steps(loaded[:, foot]) for foot in range(2)),
        "fallen": has_fallen,
        "slip_m": slid,
        "slip_share": slid / abs(way) if abs(way) > 0.05 else None,
        "tracking_rms_deg": rms(error),
        "output_peak_nm": peak(output),
        "output_rms_nm": rms(output),
        "motor_peak_nm": peak(motor),
        "motor_rms_nm": rms(motor),
        "speed_peak_deg_s": peak(speed),
    }


def hashes(trace: Trace) -> Dict[str, str]:
    """SHA-256 of the pulses (us) and of the trunk's path (m, m, rad) of a run; little endian, 64 bits."""

    def of(array: Any) -> str:
        return hashlib.sha256(np.ascontiguousarray(array, dtype="<f8").tobytes()).hexdigest()

    return {"pulses_sha256": of(trace.pulses_us), "path_sha256": of(trace.trunk)}


def together(runs: Sequence[Dict[str, Any]]) -> Dict[str, Any]:
    """Means and extremes of several runs; lists have the order of ``JOINTS``, names have the units."""
    metres = [run["metres"] for run in runs]
    slips = [run["slip_share"] for run in runs if run["slip_share"] is not None]
    limited = [float(run["limited_share"]) for run in runs if run.get("limited_share") is not None]
    found: Dict[str, Any] = {
        "runs": len(runs),
        "falls": sum(run["fallen"] for run in runs),
        "metres_mean": float(np.mean(metres)),
        "metres_least": min(metres),
        "metres_most": max(metres),
        "steps_mean": float(np.mean([run["steps"] for run in runs])),
        "slip_share_mean": float(np.mean(slips)) if slips else None,
        "limited_share_mean": float(np.mean(limited)) if limited else None,
        "joints": list(JOINTS),
    }
    for name in ("output_peak_nm", "motor_peak_nm", "speed_peak_deg_s"):
        found[name] = [max(run[name][joint] for run in runs) for joint in range(4)]
    for name in ("output_rms_nm", "motor_rms_nm", "tracking_rms_deg"):
        found[name] = [float(np.sqrt(np.mean([run[name][joint] ** 2 for run in runs]))) for joint in range(4)]
    return found

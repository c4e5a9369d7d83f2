"""A run as a strip of stick figures in one picture, drawn from the joint angles."""

import math
import os
from typing import Any, List, Tuple, Union

from .._errors import InputError
from .model import arc
from .simulation import Trace

#: Figures in a strip.
FRAMES = 12
_COLOURS = {"left": "#1f77b4", "right": "#d95f02"}


def _turn(point: Tuple[float, float], angle: float) -> Tuple[float, float]:
    """A point (x, z) turned about y by an angle, rad, positive from z to x."""
    x, z = point
    return x * math.cos(angle) + z * math.sin(angle), z * math.cos(angle) - x * math.sin(angle)


def leg(trace: Trace, row: int, side: str) -> List[Tuple[float, float]]:
    """Points of a leg, x and z in m: hip, knee, ankle above the sole, and the arc of the foot."""
    robot, (x, z, lean) = trace.robot, (float(value) for value in trace.trunk[row])
    hip, knee = (float(trace.angles_rad[row, place + (side == "right")]) for place in (0, 2))
    top = (x, robot.hip_m * (1.25 if trace.rig == "hung" else 1.0) + z)
    thigh, shank = lean - hip, lean - hip + knee
    down = _turn((0.0, -robot.thigh.length_m), thigh)
    joint = (top[0] + down[0], top[1] + down[1])

    def of_shank(point: Tuple[float, float]) -> Tuple[float, float]:
        turned = _turn(point, shank)
        return joint[0] + turned[0], joint[1] + turned[1]

    sole = [of_shank(point) for point in arc(robot.shank, robot.foot)]
    return [top, joint, of_shank((0.0, -robot.shank.length_m + 0.1 * robot.hip_m)), *sole]


def strip(trace: Trace, path: Union[str, "os.PathLike[str]"], title: str) -> None:
    """Writes a picture (PNG) of a run: figures at equal times, one behind the other, with the way in m below the floor."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise ImportError("a picture needs matplotlib, which is not installed: pip install 'footfall[body]'") from error
    figure: Any = Figure(figsize=(14.0, 3.6), dpi=100)
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    robot, count = trace.robot, len(trace.time_s)
    apart = 1.1 * robot.hip_m
    last = round(apart * (FRAMES - 1), 6)
    axes.axhline(0.0, color="0.4", linewidth=1.0)
    for number in range(FRAMES):
        row = round((count - 1) * number / (FRAMES - 1))
        x, _, lean = (float(value) for value in trace.trunk[row])
        shift = apart * number - x
        hip = leg(trace, row, "left")[0]
        head = _turn((0.0, robot.trunk.length_m), lean)
        axes.plot([hip[0] + shift, hip[0] + head[0] + shift], [hip[1], hip[1] + head[1]], color="0.2", linewidth=5.0, solid_capstyle="round")
        for side in ("right", "left"):
            points = leg(trace, row, side)
            bones, sole = points[:3], points[3:]
            axes.plot([at + shift for at, _ in bones], [up for _, up in bones], color=_COLOURS[side], linewidth=2.5, marker="o", markersize=3.0)
            first, end = sole[0], sole[-1]
            outline = [bones[2], *sole, bones[2]] if first != end else bones
            axes.plot([at + shift for at, _ in outline], [up for _, up in outline], color=_COLOURS[side], linewidth=1.5)
        axes.text(apart * number, -0.17 * robot.hip_m, f"{trace.time_s[row]:.1f} s\n{x:.2f} m", ha="center", va="top", fontsize=8)
    axes.set_xlim(-apart, last + apart)
    axes.set_ylim(-0.55 * robot.hip_m, 1.25 * robot.hip_m + robot.trunk.length_m)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title(f"{title} (simulation; left leg blue, right leg orange)", fontsize=9)
    figure.tight_layout()
    try:
        figure.savefig(path, format="png")
    except OSError as error:
        raise InputError(f"{os.fspath(path)}: the picture cannot be written: {error.strerror or error}") from error

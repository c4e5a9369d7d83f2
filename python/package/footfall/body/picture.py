"""Pictures: a run as a strip of stick figures or as a video; what servos do to the limbs of a person who wears them."""

import math
import os
import shutil
import subprocess
import textwrap
from typing import Any, List, Tuple, Union

import numpy as np

from .. import JOINTS
from .._errors import FootfallError, InputError
from .cuff import Worn
from .model import arc
from .outputs import whole
from .simulation import Trace

Path = Union[str, "os.PathLike[str]"]

#: Figures in a strip.
FRAMES = 12
#: Pictures of a video, 1/s: a whole number of milliseconds each, and of hundredths of a second, which a GIF counts.
FRAMES_S = 25
#: How a picture of a run is read.
_READ = "simulation; left leg blue, right leg orange"
_COLOURS = {"left": "#1f77b4", "right": "#d95f02"}


def _figure(width_in: float, height_in: float, **options: Any) -> Any:
    """A figure of 100 pixels an inch that no window shows."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise ImportError("a picture needs matplotlib, which is not installed: pip install 'footfall[body]'") from error
    figure: Any = Figure(figsize=(width_in, height_in), dpi=100, **options)
    FigureCanvasAgg(figure)
    return figure


def _save(figure: Any, path: Path) -> None:
    with whole(path) as beside:
        figure.savefig(beside, format="png")


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


def _on_slope(axes: Any, trace: Trace, x: float) -> Any:
    """The transform that draws points on the floor with its slope, about the floor's point at ``x`` m."""
    from matplotlib.transforms import Affine2D

    return Affine2D().rotate_deg_around(x, 0.0, trace.slope_deg) + axes.transData


def _lines(text: str, width: int) -> str:
    """A title in lines of so many letters; no unit."""
    return "\n".join(textwrap.wrap(text, width))


def _body(axes: Any, trace: Trace, row: int, shift: float, transform: Any) -> None:
    """Draws trunk and legs of a row, moved by ``shift`` m along the floor, with a transform of the axes."""
    lean, hip = float(trace.trunk[row, 2]), leg(trace, row, "left")[0]
    head = _turn((0.0, trace.robot.trunk.length_m), lean)
    axes.plot([hip[0] + shift, hip[0] + head[0] + shift], [hip[1], hip[1] + head[1]], color="0.2", linewidth=5.0, solid_capstyle="round", transform=transform)
    for side in ("right", "left"):
        points = leg(trace, row, side)
        bones, sole = points[:3], points[3:]
        axes.plot([at + shift for at, _ in bones], [up for _, up in bones], color=_COLOURS[side], linewidth=2.5, marker="o", markersize=3.0, transform=transform)
        first, end = sole[0], sole[-1]
        outline = [bones[2], *sole, bones[2]] if first != end else bones
        axes.plot([at + shift for at, _ in outline], [up for _, up in outline], color=_COLOURS[side], linewidth=1.5, transform=transform)


def writer(path: Path) -> str:
    """How a file of this name is drawn: ``png``, ``gif`` or ``mp4``; an error for another ending, or where what draws it is missing. No unit."""
    kind = os.path.splitext(os.fspath(path))[1].lower()[1:]
    if kind not in ("png", "gif", "mp4"):
        raise InputError(f"{os.fspath(path)}: allowed are names that end with .png (a strip), .gif and .mp4 (a video)")
    if kind == "mp4" and shutil.which("ffmpeg") is None:
        raise FootfallError(
            f"{os.fspath(path)}: a video as MP4 needs the program ffmpeg, which is not on the path: sudo apt-get install ffmpeg, brew install ffmpeg; "
            "or take .gif, which needs nothing more"
        )
    return kind


def draw(trace: Trace, path: Path, title: str) -> None:
    """Writes a run as a strip (PNG) or as a video (GIF, MP4), by the ending of the name."""
    if writer(path) == "png":
        strip(trace, path, title)
    else:
        video(trace, path, title)


def video(trace: Trace, path: Path, title: str) -> None:
    """Writes a run as a video in true time, GIF or MP4: the picture moves with the body, over a floor with a mark each 0.1 m."""
    figure = _figure(6.4, 4.8)
    from matplotlib.animation import FFMpegWriter, PillowWriter

    robot = trace.robot
    movie = FFMpegWriter(fps=FRAMES_S) if writer(path) == "mp4" else PillowWriter(fps=FRAMES_S)
    axes = figure.add_subplot()
    figure.subplots_adjust(top=0.85)
    apart_ms, wide = round(1000.0 / FRAMES_S), 1.6 * robot.hip_m
    rise = wide * abs(math.sin(math.radians(trace.slope_deg)))
    try:
        with whole(path) as beside, movie.saving(figure, beside, dpi=100):
            for row in range(0, len(trace.time_s), apart_ms):
                axes.clear()
                x = float(trace.trunk[row, 0])
                transform = _on_slope(axes, trace, x)
                axes.plot([x - 2.0 * wide, x + 2.0 * wide], [0.0, 0.0], color="0.4", linewidth=1.0, transform=transform)
                for mark in range(math.ceil((x - wide) * 10.0), math.floor((x + wide) * 10.0) + 1):
                    deep, metre = (0.08, True) if mark % 10 == 0 else (0.03, False)
                    axes.plot([mark / 10.0] * 2, [-deep * robot.hip_m, 0.0], color="0.4", linewidth=1.0, transform=transform)
                    if metre:
                        axes.text(mark / 10.0, -0.1 * robot.hip_m, f"{mark // 10} m", ha="center", va="top", fontsize=8, transform=transform)
                _body(axes, trace, row, 0.0, transform)
                axes.set_xlim(x - wide, x + wide)
                axes.set_ylim(-0.3 * robot.hip_m - rise, 1.4 * robot.hip_m + robot.trunk.length_m)
                axes.set_aspect("equal")
                axes.set_axis_off()
                axes.set_title(_lines(f"{title}; {_READ}", 95) + f"\n{trace.time_s[row]:.2f} s, {x:.2f} m", fontsize=9)
                movie.grab_frame()
    except subprocess.CalledProcessError as error:
        raise FootfallError(f"{os.fspath(path)}: the video cannot be written: {error}") from error


def strip(trace: Trace, path: Path, title: str) -> None:
    """Writes a picture (PNG) of a run: figures at equal times, one behind the other, with the way in m below the floor."""
    figure = _figure(14.0, 3.6)
    axes = figure.add_subplot()
    robot, count = trace.robot, len(trace.time_s)
    apart = 1.1 * robot.hip_m
    last = apart * (FRAMES - 1)
    transform, rise = _on_slope(axes, trace, 0.0), last * math.sin(math.radians(trace.slope_deg))
    axes.plot([-apart, last + apart], [0.0, 0.0], color="0.4", linewidth=1.0, transform=transform)
    between_s = float(trace.time_s[-1]) / (FRAMES - 1)
    # Figures that are close in time have other labels nevertheless.
    digits = 1 if between_s >= 0.5 else 2 if between_s >= 0.02 else 3
    for number in range(FRAMES):
        row = round((count - 1) * number / (FRAMES - 1))
        x = float(trace.trunk[row, 0])
        _body(axes, trace, row, apart * number - x, transform)
        label = f"{trace.time_s[row]:.{digits}f} s\n{x:.2f} m"
        axes.text(apart * number, -0.17 * robot.hip_m, label, ha="center", va="top", fontsize=8, transform=transform)
    axes.set_xlim(-apart, last + apart)
    axes.set_ylim(min(0.0, rise) - 0.55 * robot.hip_m, max(0.0, rise) + 1.25 * robot.hip_m + robot.trunk.length_m)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title(_lines(f"{title}; {_READ}", 200), fontsize=9)
    figure.tight_layout()
    _save(figure, path)


def torques(worn: Worn, from_s: float, to_s: float, path: Path, title: str) -> None:
    """Writes a picture (PNG): recorded, driven and asked angle (deg) and the torque on the limb (N m) of the left leg between two times, s."""
    figure = _figure(12.0, 6.4, layout="constrained")
    panels = figure.subplots(2, 2, sharex=True)
    rows = (worn.time_s >= from_s - 1.0) & (worn.time_s <= to_s)
    time_s = worn.time_s[rows]
    for column, joint in enumerate(("left_hip", "left_knee")):
        place, (above, below) = JOINTS.index(joint), panels[:, column]
        above.plot(time_s, np.degrees(worn.person_rad[rows, place]), color="0.3", linewidth=2.0, label="person (recorded)")
        above.plot(time_s, np.degrees(worn.driven_rad[rows, place]), color=_COLOURS["left"], linewidth=1.0, label="servo")
        above.plot(time_s, np.degrees(worn.target_rad[rows, place]), color=_COLOURS["right"], linewidth=1.0, label="last pulse")
        above.set(title=joint.replace("_", " "), ylabel="angle, deg")
        below.axhline(0.0, color="0.7", linewidth=0.8)
        below.plot(time_s, worn.limb_nm[rows, place], color=_COLOURS["left"], linewidth=1.0)
        below.set(xlabel="time since the first servo frame, s", ylabel="torque on the limb, N m")
        for panel in (above, below):
            panel.axvspan(from_s, to_s, color="0.95", zorder=0)
            panel.margins(x=0.0)
    handles, names = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=3)
    figure.suptitle(f"{title} (simulation; judged in the grey part)", fontsize=10)
    _save(figure, path)

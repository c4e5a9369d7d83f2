"""A person who walks along a recording: the angles of four joints over time, smooth enough to be differentiated twice."""

import math
import os
from dataclasses import dataclass
from typing import List, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt

from .. import JOINTS, Fit, fit, read
from .._errors import FootfallError, InputError

Path = Union[str, "os.PathLike[str]"]
Floats = npt.NDArray[np.float64]

#: The recording of the repository, in a clone.
RECORDING = "tests/traces/gaitkit_fukuchi_healthy.csv"
#: The highest frequency of the motion that is kept, Hz: customary for joint angles is 6 Hz, and the filter is not steep.
_HIGHEST_HZ = 10.0
#: Steps of the table of one loop, s.
_TABLE_S = 0.0005
#: Angles of a person who stands, rad, in the order of ``JOINTS``: those of the park pose.
STANDING_RAD = np.radians([0.0, 0.0, 5.0, 5.0])
#: Time in which a person starts to walk or comes to a stand, s, and in which the cadence changes, s. Assumed.
START_S, CADENCE_S = 0.6, 0.2


@dataclass(frozen=True)
class Change:
    """From a time on, a person walks with another stride time, or stands."""

    at_s: float
    """When it begins, s."""
    walks: bool
    """Whether the person walks; no unit."""
    stride_s: float
    """Stride time, s."""


@dataclass(frozen=True)
class Motion:
    """Angles, speeds and accelerations of the four joints, in the order of ``JOINTS``; rows at equal times."""

    time_s: Floats
    """Shape (n,), s."""
    rad: Floats
    """Shape (n, 4), rad."""
    rad_s: Floats
    """Shape (n, 4), rad/s."""
    rad_s2: Floats
    """Shape (n, 4), rad/s^2."""


def _ramp(time_s: Floats, at_s: float, over_s: float) -> Tuple[Floats, Floats, Floats]:
    """A smooth step from 0 to 1 (quintic) with its first and second derivative."""
    x = np.clip((time_s - at_s) / over_s, 0.0, 1.0)
    value = x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
    first = 30.0 * x**2 * (1.0 - x) ** 2 / over_s
    second = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / over_s**2
    return value, first, second


class Person:
    """A recording's whole strides, repeated without end.

    The strides between the first and the last heel of the fit are cut out, the difference of their ends is taken away as a straight line, and what is
    above 10 Hz is left out, so that speed and acceleration exist everywhere, the seam included.
    """

    def __init__(self, recording: Path, *, follow: str = "left_hip") -> None:
        repaired = read(recording).condition(low_pass="customary")
        missing = [joint for joint in JOINTS if joint not in repaired.joints]
        if missing:
            raise InputError(f"{os.fspath(recording)}: no {', '.join(missing)}; a person who wears the robot needs {', '.join(JOINTS)}")
        if repaired.unusable_s:
            spans = ", ".join(f"{first:.2f} to {last:.2f} s" for first, last in repaired.unusable_s)
            raise InputError(f"{os.fspath(recording)}: unusable at {spans}; cut the recording to a part that is whole")
        #: The follower of this person, fitted to the whole recording.
        self.fitted: Fit = fit(recording, follow=follow, starts=10)
        spans_s = self.fitted.stride_spans_s
        if not spans_s:
            raise FootfallError(f"{os.fspath(recording)}: no whole stride was found")
        #: Mean stride time of the recording, s.
        self.stride_s: float = self.fitted.stride_s
        first_s, last_s = spans_s[0][0], spans_s[-1][1]
        count = round((last_s - first_s) * repaired.rate_hz)
        at = first_s + np.arange(count + 1) * (last_s - first_s) / count
        columns = [repaired.joints.index(joint) for joint in JOINTS]
        angles = np.stack([np.interp(at, repaired.time_s, repaired.angles_rad[:, column]) for column in columns], axis=1)
        #: By how much the ends of the cut differ, rad, shape (4,).
        self.seam_rad: Floats = angles[-1] - angles[0]
        closed = (angles - np.linspace(-0.5, 0.5, count + 1)[:, None] * self.seam_rad)[:-1]
        #: Length of the loop, s.
        self.loop_s: float = last_s - first_s
        spectrum, hz = np.fft.rfft(closed, axis=0), np.fft.rfftfreq(count, self.loop_s / count)
        spectrum[hz > _HIGHEST_HZ] = 0.0
        rows = math.ceil(self.loop_s / _TABLE_S)
        turn = 2j * math.pi * hz[:, None]
        # A row more than the loop, so that the last one interpolates to the first.
        self._table = [
            np.concatenate([table, table[:1]]) * (rows / count)
            for table in (np.fft.irfft(spectrum * turn**order, rows, axis=0) for order in range(3))
        ]
        self._rows = rows

    def _at(self, place_s: Floats) -> List[Floats]:
        """Angle and its first and second derivative at times of the recording, s; each of shape (n, 4)."""
        row = np.mod(place_s / self.loop_s, 1.0) * self._rows
        low = np.minimum(row.astype(np.int64), self._rows - 1)
        part = (row - low)[:, None]
        return [table[low] * (1.0 - part) + table[low + 1] * part for table in self._table]

    def move(self, seconds: float, step_s: float, changes: Sequence[Change], start_s: float = 0.0) -> Motion:
        """The motion for a time, s, in steps of ``step_s`` s. Before the first change the person stands. ``start_s``: time of the first row, s."""
        time_s: Floats = start_s + np.arange(round(seconds / step_s) + 1, dtype=np.float64) * step_s
        rate, rate_1 = np.zeros_like(time_s), np.zeros_like(time_s)
        weight = [np.zeros_like(time_s) for _ in range(3)]
        last_rate, last_weight = 0.0, 0.0
        for change in changes:
            if not 0.3 <= change.stride_s <= 4.0:
                raise InputError(f"stride time = {change.stride_s} s: allowed is 0.3 to 4 s")
            goal = self.stride_s / change.stride_s
            # A person who stands has no phase: a start begins with its rate.
            up, up_1, _ = _ramp(time_s, change.at_s, CADENCE_S) if last_rate else (np.ones_like(time_s), np.zeros_like(time_s), None)
            rate, rate_1 = rate + (goal - last_rate) * up, rate_1 + (goal - last_rate) * up_1
            size = float(change.walks) - last_weight
            weight = [one + size * part for one, part in zip(weight, _ramp(time_s, change.at_s, START_S))]
            last_rate, last_weight = goal, float(change.walks)
        place = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) * (step_s / 2.0))])
        angle, first, second = self._at(place)
        away, away_1 = angle - STANDING_RAD, first * rate[:, None]
        away_2 = second * rate[:, None] ** 2 + first * rate_1[:, None]
        w, w_1, w_2 = (one[:, None] for one in weight)
        return Motion(time_s, STANDING_RAD + w * away, w * away_1 + w_1 * away, w * away_2 + 2.0 * w_1 * away_1 + w_2 * away)

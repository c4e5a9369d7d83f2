"""A gait of both legs, half a stride apart, as a vector of numbers: Fourier coefficients of hip and knee, and the stride time."""

import math
from dataclasses import dataclass
from typing import Any, List, Tuple

import numpy as np
import numpy.typing as npt

from .. import JOINTS, Generator

Floats = npt.NDArray[np.float64]

#: Harmonics of the hips and of the knees.
HARMONICS = (2, 3)
#: Allowed times of a stride, s.
STRIDE_S = (0.4, 2.0)
_PLACES = (JOINTS.index("left_hip"), JOINTS.index("left_knee"))


@dataclass(frozen=True)
class Gait:
    """Stride time and the angles of the left leg's hip and knee over a stride; the right leg's are half a stride later."""

    stride_s: float
    """Time of a stride, s."""
    hip_deg: Floats
    """Mean, cosines and sines of the harmonics, deg; shape (5,)."""
    knee_deg: Floats
    """Mean, cosines and sines of the harmonics, deg; shape (7,)."""

    @staticmethod
    def of(generator: Generator, settle_s: float = 20.0) -> "Gait":
        """The nearest gait to the left leg of a generator of any kind, after a time, s, in which it settles on its limit cycle."""
        stride_s = generator.stride_s
        generator.reset()
        motion = generator.run(settle_s + 5.0 * stride_s)
        late = motion.time_s > settle_s
        joints = []
        for place, count in zip(_PLACES, HARMONICS):
            # Least squares, since a stride need not be a whole number of control periods.
            turns = np.outer(motion.time_s[late] * (2.0 * math.pi / stride_s), np.arange(1, count + 1))
            columns = np.concatenate([np.ones((len(turns), 1)), np.cos(turns), np.sin(turns)], axis=1)
            joints.append(np.degrees(np.linalg.lstsq(columns, motion.angles_rad[late, place].astype(np.float64), rcond=None)[0]))
        return Gait(stride_s, joints[0], joints[1])

    def vector(self) -> Floats:
        """Stride time (s), hip and knee (deg); shape (13,)."""
        return np.concatenate([[self.stride_s], self.hip_deg, self.knee_deg])

    @staticmethod
    def of_vector(vector: Any) -> "Gait":
        """The gait of a ``vector``; s and deg."""
        values = np.asarray(vector, dtype=np.float64)
        split = 2 + 2 * HARMONICS[0]
        return Gait(float(values[0]), values[1:split], values[split:])

    def joints(self) -> List[Tuple[str, Floats, Floats]]:
        """Name, mean with cosines, and sines of each joint, deg, in the order of ``JOINTS``."""
        found = []
        for joint in JOINTS:
            values = self.hip_deg if joint.endswith("hip") else self.knee_deg
            count = len(values) // 2
            # Half a stride turns the odd harmonics round.
            sign = np.ones(count) if joint.startswith("left") else (-1.0) ** np.arange(1, count + 1)
            found.append((joint, np.concatenate([values[:1], sign * values[1 : count + 1]]), sign * values[count + 1 :]))
        return found

    def text(self, settings: str) -> str:
        """A generator file of the kind ``shape``; ``settings`` says how the gait was found. Units are in the file."""
        lines = ['schema = 2', 'generator = "shape"', "", "[provenance]", 'source = "a search on the simulated body"', 'source_sha256 = ""']
        lines += ['made_by = "footfall.body search"', f'settings = "{settings}"', "", "[shape]", f"stride_s = {self.stride_s:.4f}"]
        for joint, means, sines in self.joints():
            lines += ["", f"[shape.{joint}]", f"mean_deg = {means[0]:.3f}"]
            for name, values in (("cos_deg", means[1:]), ("sin_deg", sines)):
                # Zero has no sign here: `-0.000` would be another file for the same gait.
                lines.append(f"{name} = [{', '.join(f'{round(float(value), 3) + 0.0:.3f}' for value in values)}]")
        return "\n".join(lines) + "\n"

    def generator(self) -> Generator:
        """The generator of its file."""
        return Generator.parse(self.text(""), name="gait")


def within(gait: Gait) -> bool:
    """Whether the time of a stride is allowed; no unit."""
    return STRIDE_S[0] <= gait.stride_s <= STRIDE_S[1] and math.isfinite(float(gait.vector().sum()))

"""Sensors on the body's joints: angles to volts by a calibration, with noise."""

import os
from typing import List, Optional, Sequence, Tuple, Union

import numpy as np

from .. import JOINTS, robot, sensor_volts
from .._errors import InputError

Path = Union[str, "os.PathLike[str]"]

#: Standard deviation of the volts, V: about five steps of the converter. Assumed.
NOISE_V = 0.004
#: Angles of the table, rad: those of a person's joints.
_TABLE_RAD = np.radians(np.arange(-60.0, 150.5, 0.5))

#: The joint that has a sensor on a board without a sensor record, with the published curve.
DEFAULT_SENSORS: Tuple[Tuple[str, Optional[Path]], ...] = (("left_knee", None),)


def sensors_of(robot_file: Optional[Path]) -> Tuple[Tuple[str, Optional[Path]], ...]:
    """The joints of a robot file that have feedback, in the order of ``JOINTS``, each with the published curve; without any, the default sensor."""
    shares = {joint: one["feedback"] for joint, one in robot(robot_file).items()}
    return tuple((joint, None) for joint in JOINTS if shares[joint]) or DEFAULT_SENSORS


class Sensors:
    """The potentiometers of some joints: ``joints`` are pairs of a joint and its sensor file, or ``None`` for the published curve."""

    def __init__(self, joints: Sequence[Tuple[str, Optional[Path]]], seed: int) -> None:
        for joint, _ in joints:
            if joint not in JOINTS:
                raise InputError(f"joint of a sensor = '{joint}': allowed is one of {', '.join(JOINTS)}")
        self._places = [JOINTS.index(joint) for joint, _ in joints]
        self._tables = [sensor_volts(_TABLE_RAD, calibration=path) for _, path in joints]
        # A stream of its own: the noise does not change what varies between robots.
        self._noise = np.random.default_rng([seed, 1])

    def volts(self, angles_rad: Sequence[float]) -> List[float]:
        """Volts of each sensor, V, at the angles of the four joints, rad."""
        noise = self._noise.normal(0.0, NOISE_V, len(self._places))
        pairs = zip(self._places, self._tables, noise.tolist())
        return [float(np.interp(angles_rad[place], _TABLE_RAD, table)) + shake for place, table, shake in pairs]

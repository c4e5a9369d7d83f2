"""A generator or a body by its name or by its file, as the command lines take them."""

import os
from typing import Optional

from .. import Generator, gaits
from .._errors import InputError
from . import body_file
from .gait import Gait
from .robots import Robot, named


def named_robot(robot: str) -> Robot:
    """The robot of a name, or of a body file whose name ends with ``.toml``."""
    return body_file.read(robot) if robot.endswith(".toml") else named(robot)


def named_generator(gait: Optional[str], speed: float = 1.0) -> Generator:
    """The generator of a file or of a gait's name; the default walk without one.

    With a ``speed``, a factor without unit, each step is so much longer in the generator's own time: the motion of steps of 1 ms is so much faster.
    """
    period_s = 0.001 * speed
    if gait is None:
        return Generator.default(period_s=period_s)
    if gait not in gaits():
        if not os.path.exists(gait):
            raise InputError(f"--gait '{gait}': no gait has this name, and no file; allowed are {', '.join(gaits())}, or a file that `footfall fit` wrote")
        return Generator.read(gait, period_s=period_s)
    # The gaits' own networks run on no board; their shape does.
    return Generator.parse(Gait.of(Generator.gait(gait)).text(""), name="gait", period_s=period_s)

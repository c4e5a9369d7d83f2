"""A generator by a gait's name or by its file, as the command lines take it."""

from typing import Optional

from .. import Generator, gaits
from .gait import Gait


def named_generator(gait: Optional[str], speed: float = 1.0) -> Generator:
    """The generator of a file or of a gait's name; the default walk without one.

    With a ``speed``, a factor without unit, each step is so much longer in the generator's own time: the motion of steps of 1 ms is so much faster.
    """
    period_s = 0.001 * speed
    if gait is None:
        return Generator.default(period_s=period_s)
    if gait not in gaits():
        return Generator.read(gait, period_s=period_s)
    # The gaits' own networks run on no board; their shape does.
    return Generator.parse(Gait.of(Generator.gait(gait)).text(""), name="gait", period_s=period_s)

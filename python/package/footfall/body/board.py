"""The flashed image on the virtual board as the driver of a body (docs/virtual-board.md)."""

from types import TracebackType
from typing import List, Optional, Sequence, Type

import numpy as np
import numpy.typing as npt

from .. import VirtualBoard
from .._board import PathLike, Step
from .._errors import BoardError, InputError
from .drivers import Frame

#: A servo frame is over so long after the supply of the servos went on, s.
_FIRST_FRAME_S = 0.1


class BoardDriver:
    """The image that would be flashed, on the virtual board. Use it in a ``with`` block: its end is that of the run on the board.

    ``elf``: the image; ``robot``: a robot record, without which no servo gets pulses; ``generator``, ``sensors``: a generator and a sensor record
    (``footfall pack`` writes them); ``emulator``: the program ``virtual-board``, as for ``footfall.VirtualBoard``. Times in s, volts in V, pulses in us.
    """

    def __init__(
        self,
        elf: PathLike,
        *,
        robot: PathLike,
        generator: Optional[PathLike] = None,
        sensors: Optional[PathLike] = None,
        emulator: Optional[PathLike] = None,
    ) -> None:
        self._board = VirtualBoard(elf, emulator=emulator, robot=robot, generator=generator, sensors=sensors)
        self._start_s = 0.0
        self._last: Optional[Step] = None

    def __enter__(self) -> "BoardDriver":
        return self

    def __exit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        self._board.__exit__(kind, error, trace)

    def _frames(self, done: Step) -> List[Frame]:
        self._last = done
        pairs = zip(done.pulses.time_s.tolist(), done.pulses.us.tolist())
        # A frame in which a servo has no pulse is that of a stop: the servos get nothing. The board's timer counts microseconds: without the rest that
        # subtracted times have, a pulse that ends with a millisecond ends with it here too.
        return [Frame(round(at - self._start_s, 6), (us[0], us[1], us[2], us[3])) for at, us in pairs if not any(np.isnan(us))]

    def joint_angles(self, pulses_us: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Joint angles, rad, that these pulses ask for, us: by the servo map of the robot record; both have the shape (..., 4)."""
        return self._board.joint_angles(pulses_us)

    def arm(self, volts: Sequence[float]) -> List[Frame]:
        """The emergency stop is tested and the button held for 0.5 s, while the sensors have about these volts, V; the first frame is at 0 s."""
        if self._last is not None:
            raise InputError("the board has run already; allowed is a new BoardDriver for each run")
        # Held by a person, a sensor is never quite still; one that is would be reported as stuck.
        tremble = np.random.default_rng(0)

        def held(_: Step) -> List[float]:
            return [volt + float(tremble.normal(0.0, 0.004)) for volt in volts]

        done = self._board.arm(held)
        until_s = done.time_s + _FIRST_FRAME_S
        while not len(done.pulses.time_s):
            if done.time_s > until_s:
                raise BoardError(f"the board has armed, but gives no pulse within {_FIRST_FRAME_S} s")
            done = self._board.step(0.001, held(done))
        self._start_s = float(done.pulses.time_s[0])
        return self._frames(done)

    def step(self, us: int, volts: Sequence[float]) -> List[Frame]:
        """Goes on for a time, us, with these volts, V, at the sensors."""
        return self._frames(self._board.step(us / 1e6, list(volts)))

    @property
    def stopped(self) -> Optional[str]:
        """Why the outputs are off; ``None`` while they are on. No unit."""
        return None if self._last is None or self._last.armed else "the board's log and lamps say why"

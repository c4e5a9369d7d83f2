"""What drives the servos: volts of the sensors in, servo frames out, one control period at a time."""

import os
from dataclasses import dataclass
from typing import List, NamedTuple, Optional, Protocol, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt

from .. import FollowStatus, Generator, JointLoop, robot as robot_maps
from .._errors import FootfallError, InputError

Path = Union[str, "os.PathLike[str]"]


class Frame(NamedTuple):
    """The pulses of one servo frame."""

    time_s: float
    """Their rising edge, s from the first frame on."""
    us: Tuple[float, float, float, float]
    """Width for each joint, in the order of ``JOINTS``, us."""


class Driver(Protocol):
    """A controller of the four servos. One with a method ``joint_angles``, as `LoopDriver` has, runs a body of the same servo map alone."""

    def arm(self, volts: Sequence[float]) -> List[Frame]:
        """Starts it and arms it, while somebody holds the body: the sensors have these volts, V. Returns the first servo frame, at 0 s."""

    def step(self, us: int, volts: Sequence[float]) -> List[Frame]:
        """Goes on for a time, us, with these volts at the sensors, V, and returns the servo frames that ended; widths in us."""


@dataclass(frozen=True)
class Pulses:
    """What a generator that follows no sensor gives from its arming on, whatever the body does."""

    frames: List[Frame]
    """Servo frames, the first at 0 s; no unit."""
    limited_share: float
    """Share of the control periods in which the gate changed a setpoint; no unit."""


class LoopDriver:
    """The control loop of the boards, computed by this package: for the same codes of the sensors the same setpoints and pulses as the board's, bit for bit.

    ``generator``: that of a generator record; without it, the default walk of an image without one. ``robot``: a robot file; ``sensors``: pairs of a joint and its sensor file, as for ``JointLoop``.
    ``speed``: factor on the speed of the gait, 0.5 to 1.5, which a host sets before the arming. The servo frames have the board's 20 ms.
    """

    #: Volts of the board's supply and the converter's reading of its reference at it, for the typical factory code of 1502 at 3.3 V.
    _SUPPLY_V, _VREFINT = 3.0, 1652
    _FRAME_TICKS = 20
    #: The image on the virtual board begins its first servo frame so many ticks after the tick that switches the outputs on, and its first tick so
    #: many milliseconds after power-on: with its default walk, and with a generator record (tests compare the pulses).
    _OF_DEFAULT_WALK, _OF_RECORD = (11, 12), (11, 12)
    #: Of the oscillator that the board measures, Hz.
    _WATCHDOG_HZ = 32_000

    def __init__(
        self,
        generator: Optional[Generator] = None,
        *,
        robot: Optional[Path] = None,
        sensors: Optional[Sequence[Tuple[str, Optional[Path]]]] = None,
        speed: float = 1.0,
    ) -> None:
        self._request = None if speed == 1.0 else f"1 set speed {speed:g}"
        self._loop = JointLoop(generator, robot=robot, sensors=sensors)
        self._first_frame_ticks, self._boot_ms = self._OF_DEFAULT_WALK if generator is None else self._OF_RECORD
        maps = robot_maps(robot).values()
        self._neutral_us, self._at_neutral_rad, self._us_per_rad = (np.array([one[key] for one in maps]) for key in ("neutral_us", "at_neutral_rad", "us_per_rad"))
        self._ticks = self._limited = 0
        self._first: Optional[int] = None

    def joint_angles(self, pulses_us: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Joint angles, rad, that these pulses ask for, us: by the servo map of the robot file; both have the shape (..., 4)."""
        angles: npt.NDArray[np.float64] = self._at_neutral_rad + (np.asarray(pulses_us, dtype=np.float64) - self._neutral_us) / self._us_per_rad
        return angles

    def _code(self, volt: float) -> int:
        """The converter's code of a voltage, V, before its ends; no unit."""
        return int(volt / self._SUPPLY_V * 4096.0)

    def _tick(self, volts: Sequence[float], *, button: bool = False, stop: bool = False) -> Optional[Frame]:
        """One control period; a servo frame if one ends in it."""
        codes = [min(4095, max(0, self._code(volt))) for volt in volts]
        clock = self._WATCHDOG_HZ if self._ticks == 0 else None
        # A host's request comes with one tick, here the first.
        request = self._request if self._ticks == 0 else None
        faults = ["break_input"] if stop else []
        tick = self._loop.tick(codes, self._VREFINT, button=button, faults=faults, watchdog_hz=clock, request=request)
        self._ticks += 1
        pulses = tick.pulses_us
        if not pulses[0]:
            return None
        if self._first is None:
            self._first = self._ticks
        self._limited += tick.limited != 0
        since = self._ticks - self._first - self._first_frame_ticks
        if since < 0 or since % self._FRAME_TICKS:
            return None
        hip, other_hip, knee, other_knee = (float(width) for width in pulses)
        return Frame(since / 1000.0, (hip, other_hip, knee, other_knee))

    def arm(self, volts: Sequence[float]) -> List[Frame]:
        """The emergency stop is tested, and the button is held for 0.5 s; V at the sensors, the first servo frame at 0 s."""
        if self._ticks:
            raise InputError("the driver has run already, and would go on from there; allowed is a new one for each run")
        # Held by a person, a sensor is never quite still; one that is would be reported as stuck.
        tremble = np.random.default_rng(0).normal(0.0, 0.004, (2000, len(volts)))
        for at in range(2000):
            held = [volt + float(shake) for volt, shake in zip(volts, tremble[at])]
            # The times of VirtualBoard.arm.
            since_power_on = at + self._boot_ms
            frame = self._tick(held, button=200 <= since_power_on < 700, stop=50 <= since_power_on < 150)
            if frame is not None:
                return [frame]
        raise FootfallError(f"the control loop does not arm: its state is {self._loop.state}, the cause {self._loop.cause}")

    @classmethod
    def pulses(cls, generator: Generator, seconds: float, *, robot: Optional[Path] = None, later_ms: int = 0) -> Pulses:
        """The pulses of a time, s, without a body, in one call of the loop: those of a driver with this generator, which follows no sensor.

        ``later_ms``: how much later the button is held than in a run, ms.
        """
        if later_ms < 0:
            raise InputError(f"later_ms = {later_ms}: allowed is 0 ms or more")
        fed_back = [joint for joint, one in robot_maps(robot).items() if one["feedback"]]
        if fed_back:
            raise InputError(f"feedback of {fed_back[0]} in the robot file: the pulses depend on the body then; allowed is a robot file without feedback")
        # Armed before two seconds, as in `arm`.
        first_frame_ticks, boot_ms = cls._OF_RECORD
        since_power_on = np.arange(2000 + later_ms + round(seconds * 1000.0)) + boot_ms
        # A sensor that moves: one that is still would be reported as stuck.
        codes = np.round(2048.0 + 300.0 * np.sin(since_power_on / 200.0)).astype(np.uint16)[:, np.newaxis]
        stop = np.where((since_power_on >= 50) & (since_power_on < 150), 1 << 1, 0)
        button = (since_power_on >= 200 + later_ms) & (since_power_on < 700 + later_ms)
        loop = JointLoop(generator, robot=robot)
        vrefint = np.full(len(codes), cls._VREFINT, dtype=np.uint16)
        ticks = loop.run(codes, vrefint, button=button, fault_bits=stop.astype(np.uint8), watchdog_hz={0: cls._WATCHDOG_HZ})
        on = np.flatnonzero(ticks.pulses_us[:, 0])
        if not len(on):
            raise FootfallError(f"the control loop does not arm: its state is {loop.state}, the cause {loop.cause}")
        count = round(seconds * 1000.0)
        widths = ticks.pulses_us[on[0] + first_frame_ticks :][: count : cls._FRAME_TICKS].astype(np.float64)
        if not widths[:, 0].all():
            raise FootfallError(f"the outputs went off within {seconds} s: {loop.cause}")
        frames = [Frame(at * cls._FRAME_TICKS / 1000.0, tuple(us)) for at, us in enumerate(widths.tolist())]
        return Pulses(frames, float(np.mean(ticks.limited[on[0] :][: count + first_frame_ticks] != 0)))

    def step(self, us: int, volts: Sequence[float], *, stop: bool = False) -> List[Frame]:
        """Goes on for a time, us, a whole number of control periods; V at the sensors. ``stop``: the emergency stop is pressed."""
        if us <= 0 or us % 1000:
            raise InputError(f"us = {us}: allowed is a whole number of milliseconds, 1000 or more")
        frames = (self._tick(volts, stop=stop) for _ in range(us // 1000))
        return [frame for frame in frames if frame is not None]

    @property
    def limited_share(self) -> float:
        """Share of the control periods since arming in which the gate changed a setpoint; no unit."""
        return 0.0 if self._first is None else self._limited / (self._ticks - self._first + 1)

    @property
    def follow_status(self) -> Optional[FollowStatus]:
        """The tracking of a follower; ``None`` for other generators. No unit."""
        return self._loop.last.follow_status

    @property
    def stopped(self) -> Optional[str]:
        """Why the outputs are off; ``None`` while they are on. No unit."""
        return None if self._loop.last.pulses_us[0] else self._loop.cause

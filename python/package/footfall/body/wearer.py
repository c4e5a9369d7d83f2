"""A person who wears the robot: recorded gait to sensor volts, the control loop or the flashed image to servo pulses, servos to torque on the limbs.

The person's motion does not depend on the servos, so the pulses are computed first, and the torques of any servo and cuff from them.
"""

import os
from dataclasses import dataclass, field
from typing import Any, Dict, List, Optional, Sequence, Tuple

import numpy as np
import numpy.typing as npt

from .. import JOINTS, Generator, VirtualBoard
from .._board import PathLike, Step
from .._errors import BoardError, FootfallError, InputError
from .cuff import LEVER_M, STEP_S, Supply, Worn
from .drivers import Frame, LoopDriver
from .recorded import Change, Motion, Path, Person
from .sensor import Sensors

Floats = npt.NDArray[np.float64]

#: The person begins to walk at this time after the first servo frame, s; what an event is happens at the second one, long after the lock.
WALKS_AT_S, EVENT_AT_S = 1.0, 10.0
#: Left out after the lock until the joints have their full amplitude, s.
_SETTLES_S = 3.0
#: Volts of a sensor whose wire is open: the board has a resistor to ground.
_OPEN_V = 0.0
#: Steps of the virtual board, s: fine around an event, since the supply of the servos is seen at the end of a step.
_BOARD_STEP_S, _FINE_STEP_S, _FINE_S = 0.005, 0.001, 0.1
#: After the emergency stop, s: steps, and for how long.
_STOP_STEP_S, _STOP_S = 0.0001, 0.003
#: Torque above which the servo is more than a tenth of what the person's own hip or knee needs to swing the leg, N m: of 23.0 and 12.8 N m
#: (`size --robot person`). A scale, not a limit of safety.
THRESHOLD_NM = {"hip": 2.3, "knee": 1.28}


@dataclass(frozen=True)
class Event:
    """What happens to a person who wears the robot."""

    name: str
    """On the command line; no unit."""
    text: str
    """In words; no unit."""
    shown_s: float
    """How long after it the torque is judged, s."""
    changes: Tuple[Change, ...] = ()
    """Beside the start of the walk; times in s."""
    sensor: str = ""
    """``open`` or ``stuck`` from the event on; no unit."""
    stops: bool = False
    """The emergency stop is pressed; no unit."""
    limp: bool = False
    """The servos' supply is switched off by hand; no unit."""
    inject: str = ""
    """What a fault script injects into the image; no unit."""


def events(stride_s: float) -> List[Event]:
    """Every event but those of the campaign; ``stride_s``: stride time of the recording, s."""
    faster = (Change(WALKS_AT_S, True, 1.1), Change(EVENT_AT_S, True, 0.9))
    stands = (Change(WALKS_AT_S, True, stride_s), Change(EVENT_AT_S, False, stride_s))
    return [
        Event("before", "before the lock: the person walks, the joints stand", 0.0),
        Event("lock", "2 s from the lock on", 0.0),
        Event("steady", "locked, from 3 s after the lock on", 0.0),
        Event("step", "cadence step from 1.1 to 0.9 s a stride", 6.0, changes=faster),
        Event("open", "sensor open: 2 s of walk, then the joints stand", 8.0, sensor="open"),
        Event("stuck", "sensor stuck at its last value", 8.0, sensor="stuck"),
        Event("stand", "the person stops", 6.0, changes=stands),
        Event("estop", "emergency stop", 2.0, stops=True),
        Event("limp", "servo power switch off", 2.0, limp=True),
        Event("reset", "reset by the watchdog (image)", 2.0, inject='{ reset = "watchdog" }'),
    ]


#: Events that are intervals of one run in which nothing happens.
OF_THE_WALK = ("before", "lock", "steady")


@dataclass
class Pulses:
    """What came to the servos; times in s from the first servo frame on."""

    frames: List[Frame] = field(default_factory=list)
    """Servo frames; s and us."""
    unpowered: List[Frame] = field(default_factory=list)
    """Frames at whose end the servo-rail enable was off, such as one that is cut; s and us."""
    rail: List[Supply] = field(default_factory=list)
    """The servo-rail enable; s."""
    locked_s: Optional[float] = None
    """When the follower locked first, s; ``None`` if it never did, or of an image, which does not say so."""
    locked_share: float = 0.0
    """Share of the time from 3 s after the lock on in which it is locked; no unit."""


def volts(person: Person, joint: str, event: Event, seconds: float, *, seed: int = 0, sensor: Optional[Path] = None) -> Floats:
    """The volts of a sensor on a joint of the person, V, with noise; shape (n,), a row a millisecond."""
    motion = person.move(seconds, 0.001, changes_of(person, event))
    sensors = Sensors([(joint, sensor)], seed)
    rows = np.array([sensors.volts(angles)[0] for angles in motion.rad.tolist()])
    late = motion.time_s >= EVENT_AT_S
    if event.sensor == "open":
        rows[late] = _OPEN_V
    elif event.sensor == "stuck":
        rows[late] = rows[np.argmax(late)]
    return rows


def changes_of(person: Person, event: Event) -> Tuple[Change, ...]:
    """The walk of an event: times in s."""
    return event.changes or (Change(WALKS_AT_S, True, person.stride_s),)


def by_the_loop(follower: Generator, event: Event, rows_v: Floats, *, robot_file: Optional[Path] = None, sensor: Optional[Path] = None) -> Pulses:
    """The pulses of the control loop in this process, for volts (V) with a row a millisecond."""
    if event.inject:
        raise InputError(f"event '{event.name}': it is injected into an image; allowed with --elf")
    if follower.follows is None:
        raise InputError("the generator follows nobody; allowed is a follower")
    driver = LoopDriver(follower, robot=robot_file, sensors=[(follower.follows, sensor)])
    found = Pulses(frames=driver.arm([float(rows_v[0])]), rail=[Supply(0.0, True)])
    locked, is_on = np.zeros(len(rows_v), dtype=bool), True
    for row, volt in enumerate(rows_v.tolist()):
        found.frames += driver.step(1000, [volt], stop=event.stops and row / 1000.0 >= EVENT_AT_S)
        status = driver.follow_status
        locked[row] = status is not None and status.state == "locked"
        if is_on != (driver.stopped is None):
            is_on = not is_on
            found.rail.append(Supply((row + 1) / 1000.0, is_on))
    if locked.any():
        found.locked_s = float(np.argmax(locked)) / 1000.0
        found.locked_share = float(locked[round((found.locked_s + _SETTLES_S) * 1000) :].mean())
    return found


class BoardRun:
    """The flashed image on the virtual board, in front of the same person.

    ``robot``, ``generator``, ``sensors``: flash records; ``script``: a fault script. The run ends with ``verdict``, which is not an error whatever it
    says: a fault may break it.
    """

    def __init__(
        self,
        elf: PathLike,
        *,
        robot: PathLike,
        generator: PathLike,
        sensors: PathLike,
        emulator: Optional[PathLike] = None,
        script: Optional[PathLike] = None,
        event_at_s: float = EVENT_AT_S,
    ) -> None:
        self._board = VirtualBoard(elf, emulator=emulator, robot=robot, generator=generator, sensors=sensors, script=script)
        self._rail, self._start_s, self._event_at_s = False, 0.0, event_at_s
        self.found = Pulses()
        #: When an event of the script came, s from the first servo frame on.
        self.injected_s: Optional[float] = None
        #: Why the run ended early; empty if it did not. No unit.
        self.ended = ""
        #: Pulses that no servo may get; no unit.
        self.violations = 0

    def _take(self, done: Step) -> None:
        for at, us, rail in zip(done.pulses.time_s.tolist(), done.pulses.us.tolist(), done.pulses.rail.tolist()):
            (self.found.frames if rail else self.found.unpowered).append(Frame(at - self._start_s, (us[0], us[1], us[2], us[3])))
        if done.rail != self._rail:
            self._rail = done.rail
            self.found.rail.append(Supply(done.time_s - self._start_s, done.rail))
        for line in done.events:
            if line["type"] == "injected" and self.injected_s is None:
                self.injected_s = line["t_s"] - self._start_s

    def run(self, rows_v: Floats, *, stop_at_s: Optional[float] = None) -> Pulses:
        """Arms with the first of the volts (V, a row a millisecond), and goes on through all of them from the first servo frame on."""
        board = self._board
        try:
            tremble = np.random.default_rng(0).normal(0.0, 0.004, 4000).tolist()
            done = board.arm(lambda step: [float(rows_v[0]) + tremble[round(step.time_s * 1000.0)]])
            while not len(done.pulses.time_s):
                if done.time_s > 2.5:
                    raise BoardError("the board has armed, but gives no pulse")
                done = board.step(0.001, [float(rows_v[0]) + tremble[round(done.time_s * 1000.0)]])
            self._start_s = float(done.pulses.time_s[0])
            self._rail = True
            self.found.rail.append(Supply(0.0, True))
            self._take(done)
            seconds = (len(rows_v) - 1) / 1000.0
            while board.time_s - self._start_s < seconds - _BOARD_STEP_S:
                now = board.time_s - self._start_s
                if stop_at_s is not None and 0.0 <= now - stop_at_s < _STOP_S:
                    # The stop cuts a pulse, and the supply goes within 0.1 ms of it: in a longer step the servo would act on the cut pulse.
                    step_s = _STOP_STEP_S
                else:
                    step_s = _FINE_STEP_S if 0.0 <= now - self._event_at_s + _BOARD_STEP_S < _FINE_S else _BOARD_STEP_S
                ends = [float(rows_v[min(round(at * 1000.0), len(rows_v) - 1)]) for at in (now, now + step_s)]
                pressed = stop_at_s is not None and now >= stop_at_s
                self._take(board.step(step_s, [[ends[0]], [ends[1]]], stop=pressed if stop_at_s is not None else None))
            self.violations = board.close().violations
        except BoardError as error:
            if not self.found.rail:
                raise
            # A fault can end the run; nothing drives a pin from then on.
            self.ended = str(error)
            self.found.rail.append(Supply(board.time_s - self._start_s, False))
        return self.found


def span(event: Event, pulses: Pulses, last_s: float) -> Tuple[float, float]:
    """From when to when the torque of an event is judged, s."""
    if event.name not in OF_THE_WALK:
        return EVENT_AT_S, min(last_s, EVENT_AT_S + event.shown_s)
    if pulses.locked_s is None:
        raise FootfallError("the follower never locked")
    spans = {"before": (WALKS_AT_S, pulses.locked_s), "lock": (pulses.locked_s, pulses.locked_s + 2.0), "steady": (pulses.locked_s + _SETTLES_S, last_s)}
    return spans[event.name]


def judged(worn: Worn, from_s: float, to_s: float) -> Dict[str, Dict[str, Any]]:
    """For each joint, what the limb felt between two times, s; names have the units."""
    rows = (worn.time_s >= from_s) & (worn.time_s < to_s)
    step_s = float(worn.time_s[1] - worn.time_s[0])
    found: Dict[str, Dict[str, Any]] = {}
    for place, joint in enumerate(JOINTS):
        torque = np.abs(worn.limb_nm[rows, place])
        above = torque > THRESHOLD_NM[joint.split("_")[1]]
        drives = np.flatnonzero(worn.motor_nm[rows, place])
        apart = np.degrees(worn.driven_rad - worn.person_rad)[rows, place]
        asked = np.degrees(worn.target_rad - worn.person_rad)[rows, place]
        asked = asked[~np.isnan(asked)]
        found[joint] = {
            "peak_nm": float(torque.max()),
            "rms_nm": float(np.sqrt(np.mean(torque**2))),
            "p95_nm": float(np.percentile(torque, 95.0)),
            "above_s": float(above.sum() * step_s),
            "peak_n": float(torque.max()) / LEVER_M[joint],
            # Of a servo that has its supply for most of the time.
            "asked_apart_rms_deg": float(np.sqrt(np.mean(asked**2))) if 2 * len(asked) > rows.sum() else None,
            "driven_apart_rms_deg": float(np.sqrt(np.mean(apart**2))),
            # The motor's last torque; the whole time if it drives until the end.
            "motor_until_s": float((drives[-1] + 1) * step_s) if len(drives) else 0.0,
        }
    return found


def most_nm(motion: Motion, joint: str, servo: Any) -> float:
    """The largest torque that this servo can impose on a rigid cuff at this motion, N m: full drive against the speed, gear and rotor."""
    place = JOINTS.index(joint)
    against = np.abs(motion.rad_s[:, place]) / servo.no_load_rad_s
    return float((servo.stall_nm * (1.0 + against) + servo.friction_nm + servo.rotor_kg_m2 * np.abs(motion.rad_s2[:, place])).max())


def finer(person: Person, event: Event, seconds: float, is_elastic: bool) -> Motion:
    """The motion in the steps that a cuff needs, for a time, s."""
    return person.move(seconds, STEP_S if is_elastic else 0.001, changes_of(person, event))


def readable(path: Path) -> str:
    """A file that exists, or an error that says which is missing; no unit."""
    if not os.path.isfile(path):
        raise InputError(f"{os.fspath(path)}: no such file")
    return os.fspath(path)


def seconds_of(names: Sequence[str], all_events: Sequence[Event]) -> float:
    """Length of the runs of some events, s."""
    return EVENT_AT_S + max([6.0] + [event.shown_s for event in all_events if event.name in names])

"""The flashed image on the virtual board, step by step with a program that simulates the robot's body."""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
import tempfile
import threading
import weakref
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Callable, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple, Type, Union

import numpy as np
import numpy.typing as npt

from ._errors import BoardError, InputError
from ._footfall import _RECORD_MAGIC
from ._results import Floats

PathLike = Union[str, "os.PathLike[str]"]
#: Volts at pins, each held or from a first to a last value; or an array for the sensors from channel 1 on.
Volts = Union[Mapping[str, Union[float, Sequence[float]]], npt.ArrayLike]

#: Version of the protocol, docs/virtual-board.md.
_VERSION = 1
#: Pins of the sensors, channels 1 to 4.
_SENSORS = ("PA1", "PC1", "PB0", "PB1")
_FOOT = "PC5"
#: Addresses of the flash records.
_SECTORS = {"generator": 0x0800_4000, "sensors": 0x0800_8000, "robot": 0x0800_C000}
#: Arguments of `footfall pack` that make a flash record.
_PACK = {
    "generator": "generator.toml -o generator.bin",
    "sensors": "--sensor left_hip=sensor.toml -o sensors.bin",
    "robot": "--robot robot.toml -o robot.bin",
}
#: The last bytes of the log that are kept for an error, as the board's buffer has.
_LOG_BYTES = 65_536
_VARIABLE = "FOOTFALL_VIRTUAL_BOARD"
_PROGRAM = "virtual-board"


class Pulses(NamedTuple):
    """Servo pulses at the pins: one row a servo frame; times in s, widths in us, shape (n, 4)."""

    time_s: Floats
    """Rising edge, s of the board's time; shape (n,)."""
    us: Floats
    """Width of each servo's pulse, us; shape (n, 4), NaN without a pulse."""
    rail: npt.NDArray[np.bool_]
    """Whether the servos' supply was on at the end of the pulses; shape (n,)."""


class Boot(NamedTuple):
    """A boot of the chip, with its time in s."""

    time_s: float
    """The board's time, s."""
    cause: str
    """``power_on``, ``brown_out``, ``iwdg``, ``software``, ``pin``."""


class Step(NamedTuple):
    """What happened in a step; times in s, angles in rad, shape (4,) in the order of ``JOINTS``."""

    time_s: float
    """End of the step, s of the board's time."""
    pulses: Pulses
    """The servo frames that were completed, widths in us."""
    armed: bool
    """The timer drives the servo pins."""
    rail: bool
    """The servos' supply is on."""
    lamps: Dict[str, bool]
    """Lamps that changed, by pin: whether they are lit at the end."""
    boots: List[Boot]
    """Boots, with times in s; the first step has that at power-on."""
    servo_rad: Optional[Floats]
    """Joint angles of the modelled servos, rad; shape (4,). ``None`` without ``servo``."""
    log: bytes
    """Records of the board, as a debug probe reads them in RTT channel 1: ``footfall watch --rtt FILE`` shows them."""
    events: List[Dict[str, Any]]
    """Other lines of the virtual board: injected faults, faults of the program, accesses that are not modelled; times in s."""


class Verdict(NamedTuple):
    """How a run ended, and what the judge of the pulses says; widths in us, times in s in ``end``."""

    exit_code: int
    """0 is a good run; no unit."""
    pulses: int
    """Number of pulses that were judged."""
    cut: int
    """Pulses that ended early, together with the servos' supply and for a cause."""
    violations: int
    """Pulses that no servo may get."""
    first: List[str]
    """The first violations in words, with times in s and widths in us."""
    end: Dict[str, Any]
    """The last line of the virtual board; its names have the units."""

    @property
    def good(self) -> bool:
        """Whether the exit code is 0; no unit."""
        return self.exit_code == 0


class VirtualBoard:
    """The image that would be flashed, on the virtual board, in steps of a body simulation; times in s, volts in V, angles in rad.

    ``elf`` is the image. ``generator``, ``sensors`` and ``robot`` are flash records, as ``footfall pack`` writes them; without a robot record no
    servo is driven. ``servo`` models servos at the pins, ``analogue`` or ``digital``, whose joints stand at ``servo_at_deg`` (shape (4,), deg).
    ``script`` is a file of faults, ``options`` are further options of the program ``virtual-board``.

    ``emulator`` is that program; without it, it is the file that the variable ``FOOTFALL_VIRTUAL_BOARD`` names, or ``virtual-board`` on the path.

    Use it in a ``with`` block: its end is that of the run, and raises :class:`BoardError` if the run was not good. Without it, the program ends
    with the last reference to the object. Threads may share one: a step ends before the next one begins.
    """

    def __init__(
        self,
        elf: PathLike,
        *,
        emulator: Optional[PathLike] = None,
        generator: Optional[PathLike] = None,
        sensors: Optional[PathLike] = None,
        robot: Optional[PathLike] = None,
        servo: Optional[str] = None,
        servo_at_deg: Optional[Sequence[float]] = None,
        script: Optional[PathLike] = None,
        options: Sequence[str] = (),
    ) -> None:
        command = [_emulator(emulator), _file(elf), "--lockstep", *options]
        for name, path in (("generator", generator), ("sensors", sensors), ("robot", robot)):
            if path is not None:
                command += ["--flash", f"{_SECTORS[name]:#010x}={_record(name, path)}"]
        if servo is not None:
            command += ["--servo", servo]
        if servo_at_deg is not None:
            command += ["--servo-at", ",".join(str(float(angle)) for angle in servo_at_deg)]
        if script is not None:
            command += ["--script", _file(script)]
        self._verdict: Optional[Verdict] = None
        self._end: Optional[Dict[str, Any]] = None
        self._time_us = 0
        self._lamps: Dict[str, bool] = {}
        self._log = bytearray()
        # One exchange with the program at a time.
        self._exchange = threading.RLock()
        # A pipe that nobody reads would stop the board.
        self._messages = tempfile.TemporaryFile()
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._messages, text=True, encoding="utf-8"
        )
        self._ended = weakref.finalize(self, _end_process, self._process, self._messages)
        try:
            self._joints = self._greeting()
        except BaseException:
            self._kill()
            raise

    def __enter__(self) -> VirtualBoard:
        return self

    def __exit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        if kind is not None:
            self._kill()
            return
        verdict = self.close()
        if not verdict.good:
            why = verdict.first or [str(lint.get("text")) for lint in verdict.end.get("lints", [])]
            raise BoardError(f"the run was not good (exit code {verdict.exit_code}): {'; '.join(why) or self._said()}")

    @property
    def time_s(self) -> float:
        """The board's time, s."""
        return self._time_us / 1e6

    @property
    def verdict(self) -> Optional[Verdict]:
        """What :meth:`close` returned; ``None`` before. Its names have the units."""
        return self._verdict

    def joint_angles(self, pulses_us: npt.ArrayLike) -> Floats:
        """Joint angles, rad, that these pulses ask for, us: by the servo map of the robot record; both have the shape (..., 4)."""
        if self._joints is None:
            raise InputError("the board has no valid robot record, which has the servo map: give one with `robot`")
        neutral, at_neutral, scale = (
            np.array([joint[key] for joint in self._joints]) for key in ("neutral_us", "deg_at_neutral", "us_per_deg")
        )
        pulses = np.asarray(pulses_us, dtype=np.float64)
        if pulses.shape[-1:] != (4,):
            raise InputError(f"pulses_us has the shape {pulses.shape}; allowed is (..., 4), one column a joint")
        angles: Floats = np.radians(at_neutral + (pulses - neutral) / scale)
        return angles

    def step(
        self,
        seconds: float,
        volts: Optional[Volts] = None,
        *,
        button: Optional[bool] = None,
        stop: Optional[bool] = None,
        foot: Optional[bool] = None,
        levels: Optional[Mapping[str, bool]] = None,
    ) -> Step:
        """Runs the board for a time, s, a whole number of microseconds up to 10 s, and returns what happened.

        ``volts`` are V at pins, ``VDDA`` (the analogue supply) and ``VDD`` (the supply of the chip): a number is held, a pair goes from its first to
        its last value. An array stands for the sensors from channel 1 on: shape (n,) is held, shape (2, n) has first and last values. ``button``
        and ``stop`` are pressed, ``foot`` is closed; ``levels`` are those of other pins. What is not given stays as it was.
        """
        request: Dict[str, Any] = {"us": _micros(seconds)}
        if volts is not None:
            request["volts"] = _volts(volts)
        if button is not None:
            request["button"] = bool(button)
        if stop is not None:
            request["stop"] = bool(stop)
        high = {pin: bool(level) for pin, level in (levels or {}).items()}
        if foot is not None:
            high[_FOOT] = bool(foot)
        if high:
            request["levels"] = high
        with self._exchange:
            lines = self._ask(request)
            last = lines[-1]
            if last["type"] == "error":
                raise InputError(f"the virtual board refuses the step: {last['text']}")
            self._time_us = last["t_us"]
            done = _step(lines)
            self._lamps.update(done.lamps)
            if done.log:
                self._log = (self._log + done.log)[-_LOG_BYTES:]
            return done

    def arm(self, body: Optional[Callable[[Step], Volts]] = None, *, step_s: float = 0.001) -> Step:
        """Does what a person does to arm the board, in steps of ``step_s`` s: tests the emergency stop, holds the button for 0.5 s, releases it.

        ``body`` takes each step and returns the volts of the next one, V, as :meth:`step` takes them; without it they stay. Returns the step in which
        the servos' supply went on. :class:`BoardError` if it is off 1 s after the release: its text has the lamps that are lit, its
        ``log`` the last bytes of the log, which the command in the text shows once they are written to a file.
        """
        at_s, gestures = 0.0, [(0.05, "stop", True), (0.15, "stop", False), (0.2, "button", True), (0.7, "button", False)]
        volts: Optional[Volts] = None
        while at_s < 1.7:
            pressed: Dict[str, bool] = {}
            while gestures and gestures[0][0] <= at_s + 1e-9:
                _, key, value = gestures.pop(0)
                pressed[key] = value
            done = self.step(step_s, volts, button=pressed.get("button"), stop=pressed.get("stop"))
            if not gestures and done.rail and done.armed:
                return done
            at_s += step_s
            volts = body(done) if body else None
        text = f"the board does not arm: the outputs are off {self.time_s:.3f} s after power-on; {self._why()}"
        raise BoardError(text, log=bytes(self._log))

    def close(self) -> Verdict:
        """Ends the run at the next whole millisecond, and returns the judge's verdict; its names have the units."""
        with self._exchange:
            return self._close()

    def _close(self) -> Verdict:
        if self._verdict is None:
            try:
                output, _ = self._process.communicate(timeout=60.0)
            except subprocess.TimeoutExpired as error:
                self._kill()
                raise BoardError("the virtual board did not end within 60 s") from error
            for text in output.splitlines():
                line = json.loads(text)
                if line["type"] == "end":
                    self._end = line
            if self._end is None:
                raise self._gone()
            judged = self._end["judged"]
            self._verdict = Verdict(
                self._process.returncode, judged["pulses"], judged["cut"], judged["violations"], judged["first"], self._end
            )
            self._messages.close()
        return self._verdict

    def _why(self) -> str:
        """Lamps of a board that does not do what it should, and how to see its log."""
        lit = ", ".join(sorted(pin for pin, on in self._lamps.items() if on)) or "none"
        if not self._log:
            return f"lamps that are lit: {lit}; its log is empty"
        show = "`footfall watch --rtt board.rtt`"
        return f"lamps that are lit: {lit}; the end of its log is in `log` of this error: write it to a file `board.rtt`, and {show} shows it"

    def _greeting(self) -> Optional[List[Dict[str, Any]]]:
        first = self._line()
        version = first.get("version") if first["type"] == "lockstep" else None
        if version != _VERSION:
            raise BoardError(
                f"the virtual board speaks version {version} of the protocol, this package version {_VERSION}: build both from one version of Footfall"
            )
        joints: Optional[List[Dict[str, Any]]] = first["joints"]
        return joints

    def _ask(self, request: Dict[str, Any]) -> List[Dict[str, Any]]:
        if self._verdict is not None or self._process.stdin is None or self._process.stdin.closed:
            raise BoardError("the run has ended; make another VirtualBoard")
        try:
            self._process.stdin.write(json.dumps(request) + "\n")
            self._process.stdin.flush()
        except OSError as error:
            raise self._gone() from error
        lines = [self._line()]
        while lines[-1]["type"] not in ("step", "error"):
            if lines[-1]["type"] == "end":
                self._end = lines[-1]
                raise BoardError(f"the run ended by itself at {self._end['t_s']} s: {self._end['reason']}")
            lines.append(self._line())
        return lines

    def _line(self) -> Dict[str, Any]:
        assert self._process.stdout is not None
        text = self._process.stdout.readline()
        if not text.endswith("\n"):
            raise self._gone()
        line: Dict[str, Any] = json.loads(text)
        return line

    def _gone(self) -> BoardError:
        self._kill()
        return BoardError(f"the virtual board has ended (exit code {self._process.returncode}): {self._said()}")

    def _said(self) -> str:
        """The messages of the program so far."""
        if self._messages.closed:
            return "no message"
        self._messages.seek(0)
        return self._messages.read().decode("utf-8", "replace").strip() or "no message"

    def _kill(self) -> None:
        self._process.kill()
        # Closes the pipes too; what is in them belongs to nobody.
        self._process.communicate()


def _end_process(process: subprocess.Popen[str], messages: IO[bytes]) -> None:
    """Ends the program of a board that nobody has any more."""
    if process.poll() is None:
        process.kill()
        process.communicate()
    messages.close()


def _emulator(given: Optional[PathLike]) -> str:
    if given is not None:
        return _file(given)
    if os.environ.get(_VARIABLE):
        return _file(os.environ[_VARIABLE])
    found = shutil.which(_PROGRAM)
    if found is None:
        raise FileNotFoundError(
            f"no program `{_PROGRAM}`: build it in a clone with `cargo build --profile host -p {_PROGRAM}`, which writes target/host/{_PROGRAM}, "
            f"and name it with `emulator` or the variable {_VARIABLE}; docs/virtual-board.md"
        )
    return found


def _file(path: PathLike) -> str:
    if not Path(path).is_file():
        raise FileNotFoundError(f"{os.fspath(path)}: no such file")
    return os.fspath(path)


def _record(name: str, path: PathLike) -> str:
    """The file of a flash record, which begins with the word of its kind."""
    magic = _RECORD_MAGIC[name]
    file = _file(path)
    with open(file, "rb") as opened:
        found = opened.read(len(magic))
    if found != magic:
        kinds = {first: f"a {kind} record" for kind, first in _RECORD_MAGIC.items()}
        what = kinds.get(found, "a TOML file, not a record" if file.endswith(".toml") else "no flash record")
        raise InputError(
            f"{name} = {file}: is {what}; allowed is a {name} record, which begins with {magic.decode()}: `footfall pack {_PACK[name]}` makes one"
        )
    return file


def _micros(seconds: float) -> int:
    micros = float(seconds) * 1e6
    if not math.isfinite(micros) or abs(micros - round(micros)) > 1e-3 or round(micros) < 1:
        raise InputError(f"seconds = {seconds}: allowed is a whole number of microseconds, from 1e-6 s to 10 s")
    return round(micros)


def _volts(volts: Volts) -> Dict[str, Union[float, List[float]]]:
    # The usual case, a thousand times a second.
    if isinstance(volts, list) and 1 <= len(volts) <= len(_SENSORS) and all(type(one) is float and math.isfinite(one) for one in volts):
        return dict(zip(_SENSORS, volts))
    if isinstance(volts, Mapping):
        held: Dict[str, Union[float, List[float]]] = {}
        for pin, value in volts.items():
            numbers = [float(one) for one in np.ravel(value)]
            if not all(map(math.isfinite, numbers)):
                raise InputError(f"volts['{pin}'] = {value}: allowed is a finite number of volts")
            held[pin] = numbers if np.ndim(value) else numbers[0]
        return held
    array = np.asarray(volts, dtype=np.float64)
    rows = array[np.newaxis] if array.ndim == 1 else array
    if array.ndim not in (1, 2) or rows.shape[0] not in (1, 2) or not 1 <= rows.shape[1] <= len(_SENSORS):
        raise InputError(f"volts has the shape {array.shape}: allowed is (n,) or (2, n) with n from 1 to {len(_SENSORS)}, one column a sensor")
    for place in np.argwhere(~np.isfinite(array)):
        where = ", ".join(map(str, place))
        raise InputError(f"volts[{where}] = {array[tuple(place)]}, pin {_SENSORS[place[-1]]}: allowed is a finite number of volts")
    columns: List[Tuple[str, List[float]]] = list(zip(_SENSORS, rows.T.tolist()))
    return {pin: column if len(column) == 2 else column[0] for pin, column in columns}


#: Of a step without a servo frame, as most are: 20 ms lie between two frames.
_NO_PULSES = Pulses(np.zeros(0), np.zeros((0, 4)), np.zeros(0, dtype=np.bool_))
for _column in _NO_PULSES:
    _column.flags.writeable = False


# The RTT channel with the records; channel 0 has lines for people.
_RECORDS = 1


def _step(lines: List[Dict[str, Any]]) -> Step:
    if len(lines) == 1 and "deg" not in lines[0]:
        (last,) = lines
        lamps = {change["pin"]: change["on"] for change in last["lamps"]}
        return Step(last["t_us"] / 1e6, _NO_PULSES, last["armed"], last["rail"], lamps, [], None, b"", [])
    kinds: Dict[str, List[Dict[str, Any]]] = {}
    for line in lines[:-1]:
        kinds.setdefault(line["type"], []).append(line)
    last, frames = lines[-1], kinds.pop("pulses", [])
    boots = [Boot(line["t_s"], line["cause"]) for line in kinds.pop("boot", [])]
    log = b"".join(bytes.fromhex(line["hex"]) for line in kinds.pop("rtt", []) if line["channel"] == _RECORDS)
    known = ("start", "status", "servos")
    us = np.array([frame["us"] for frame in frames], dtype=np.float64).reshape(len(frames), 4)
    rail = np.array([frame["rail"] for frame in frames], dtype=np.bool_)
    pulses = Pulses(np.array([frame["t_s"] for frame in frames], dtype=np.float64), us, rail)
    return Step(
        time_s=last["t_us"] / 1e6,
        pulses=pulses,
        armed=last["armed"],
        rail=last["rail"],
        lamps={change["pin"]: change["on"] for change in last["lamps"]},
        boots=boots,
        servo_rad=np.radians(last["deg"]) if "deg" in last else None,
        log=log,
        events=[line for line in lines[:-1] if line["type"] in kinds and line["type"] not in known],
    )

"""Result types of footfall: named tuples of arrays, with the unit in each name."""

from __future__ import annotations

import math
import warnings
from typing import TYPE_CHECKING, Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
import numpy.typing as npt

from ._errors import InputError, RecordingWarning

if TYPE_CHECKING:
    import pandas

Floats = npt.NDArray[np.float64]
Singles = npt.NDArray[np.float32]
Texts = npt.NDArray[np.str_]
Names = Tuple[npt.NDArray[np.uint8], Sequence[str]]


def _named(column: Names) -> Texts:
    """The names that the numbers of a column stand for."""
    numbers, names = column
    return np.array(names, dtype=np.str_)[numbers]


class Motion(NamedTuple):
    """The motion of a generator: one row a time; times in s, angles in rad, rates in rad/s, phase in cycles."""

    time_s: Floats
    """Time since the start, s; shape (n,)."""
    angles_rad: Singles
    """Joint angles, rad, flexion positive; shape (n, joints)."""
    rates_rad_s: Singles
    """Angular velocities, rad/s; shape (n, joints)."""
    phase_cycles: Floats
    """Phase of the gait, cycles, 0 to below 1; shape (n,)."""
    joints: List[str]
    """Names of the joints, in the order of the columns."""


class FollowStatus(NamedTuple):
    """The tracking of a follower in one tick: state, fault, phase error in rad, stride time in s, confidence from 0 to 1."""

    state: str
    """``stopped``, ``seeking``, ``locked`` or ``holding``."""
    fault: str
    """Fault of the sensor; empty if it has none."""
    phase_error_rad: float
    """Phase of the person less the estimated phase, rad of the cycle."""
    stride_s: float
    """Estimated stride time, s."""
    confidence: float
    """Agreement of measured and predicted angle, 0 to 1."""


class _FollowingFields(NamedTuple):
    time_s: Floats
    angles_rad: Singles
    phase_cycles: Floats
    state: Texts
    fault: Texts
    phase_error_rad: Singles
    stride_s: Singles
    confidence: Singles


class Following(_FollowingFields):
    """A follower over time, one row a sample, shape (n,): time and stride time in s, phase in cycles, phase error in rad, state, fault,
    confidence (0 to 1); the angles of its joints in rad have the shape (n, 4)."""

    __slots__ = ()

    @property
    def frequency_hz(self) -> Singles:
        """Estimated stride frequency, Hz; shape (n,)."""
        return np.divide(np.float32(1.0), self.stride_s)

    @property
    def locked(self) -> npt.NDArray[np.bool_]:
        """Whether phase and stride frequency are known: the state is ``locked``; no unit, shape (n,)."""
        return np.asarray(self.state == "locked", dtype=np.bool_)


def _following(
    time_s: Floats,
    angles_rad: Singles,
    phase_cycles: Floats,
    state: Names,
    fault: Names,
    phase_error_rad: Singles,
    stride_s: Singles,
    confidence: Singles,
) -> Following:
    return Following(time_s, angles_rad, phase_cycles, _named(state), _named(fault), phase_error_rad, stride_s, confidence)


class Tick(NamedTuple):
    """What the control loop gave in one tick of 1 ms: setpoints in rad, shape (4,), pulses in us, shape (4,)."""

    tick: int
    """Control periods (ms) since the boot."""
    state: str
    """State of the supervisor."""
    cause: str
    """Why the last motion ended or was refused."""
    measured_rad: Singles
    """Angle of each sensor channel, rad; shape (4,)."""
    validity: List[str]
    """Validity of each channel; empty for a channel without a sensor."""
    setpoints_rad: Singles
    """Setpoints, rad; shape (4,)."""
    pulses_us: npt.NDArray[np.uint16]
    """Servo pulses, us; shape (4,), 0 while the outputs are off."""
    limited: int
    """Limits that changed a setpoint, as bits: 0 range, 1 pose, 2 rate, 3 acceleration."""
    setpoint_hash: int
    """Hash over every setpoint so far."""
    follow_status: Optional[FollowStatus]
    """Tracking of a follower; ``None`` for other generators."""
    counters: Tuple[int, int, int, int, int]
    """Calls, late ticks, missed control periods, overruns of the converter, ticks in which a limit acted."""


class Ticks(NamedTuple):
    """What the control loop gave, one row a call of 1 ms or more: setpoints in rad and pulses in us, shape (n, 4)."""

    tick: npt.NDArray[np.uint32]
    """Control periods (ms) since the boot; shape (n,)."""
    time_s: Floats
    """The same in s; shape (n,)."""
    state: Texts
    """State of the supervisor; shape (n,)."""
    cause: Texts
    """Why the last motion ended or was refused; shape (n,)."""
    measured_rad: Singles
    """Angle of each sensor channel, rad; shape (n, 4)."""
    validity: Texts
    """Validity of each channel; empty for a channel without a sensor; shape (n, 4)."""
    setpoints_rad: Singles
    """Setpoints, rad; shape (n, 4)."""
    pulses_us: npt.NDArray[np.uint16]
    """Servo pulses, us; shape (n, 4), 0 while the outputs are off."""
    limited: npt.NDArray[np.uint8]
    """Limits that changed a setpoint, as bits: 0 range, 1 pose, 2 rate, 3 acceleration; shape (n,)."""
    setpoint_hash: npt.NDArray[np.uint64]
    """Hash over every setpoint up to this tick; shape (n,)."""


def _ticks(
    tick: npt.NDArray[np.uint32],
    time_s: Floats,
    state: Names,
    cause: Names,
    measured_rad: Singles,
    validity: Names,
    setpoints_rad: Singles,
    pulses_us: npt.NDArray[np.uint16],
    limited: npt.NDArray[np.uint8],
    setpoint_hash: npt.NDArray[np.uint64],
) -> Ticks:
    return Ticks(
        tick, time_s, _named(state), _named(cause), measured_rad, _named(validity), setpoints_rad, pulses_us, limited, setpoint_hash
    )


class Inputs(NamedTuple):
    """The inputs of a recorded board, one row a call; ``elapsed`` in control periods of 1 ms, codes of the converter without unit."""

    boot: npt.NDArray[np.uint32]
    """Number of the boot, from 1; shape (n,)."""
    tick: npt.NDArray[np.uint32]
    """Control periods (ms) since that boot; shape (n,)."""
    elapsed: npt.NDArray[np.uint8]
    """Control periods (ms) since the call before; shape (n,)."""
    codes: npt.NDArray[np.uint16]
    """Code of each sensor; shape (n, sensors)."""
    vrefint: npt.NDArray[np.uint16]
    """Code of the chip's reference; shape (n,)."""
    button: npt.NDArray[np.bool_]
    """The button is pressed; shape (n,)."""
    foot: npt.NDArray[np.bool_]
    """The foot is on the floor; shape (n,)."""
    late: npt.NDArray[np.bool_]
    """The tick began too late; shape (n,)."""
    fault_bits: npt.NDArray[np.uint8]
    """Faults of the board as bits, see ``JointLoop.run``; shape (n,)."""
    watchdog_hz: Dict[int, int]
    """Measurements of the clock of the watchdog: row and Hz."""
    debugger: npt.NDArray[np.uint8]
    """Debugger: 0 absent, 1 attached, 2 refused; shape (n,)."""
    program_unproven: npt.NDArray[np.bool_]
    """The program in flash is not proven to be the one that was built; shape (n,)."""
    requests: Dict[int, str]
    """Requests of a host: row and text."""


class Outputs(NamedTuple):
    """The outputs of a recorded board, one row a call: setpoints in deg (as the recording has them) and pulses in us, shape (n, 4)."""

    known: npt.NDArray[np.bool_]
    """Whether the recording has the output of this call; shape (n,)."""
    state: List[str]
    """State of the supervisor; empty where not known."""
    setpoints_deg: Singles
    """Setpoints, deg; shape (n, 4), NaN where not known."""
    pulses_us: npt.NDArray[np.uint16]
    """Servo pulses, us; shape (n, 4), 0 while the outputs are off."""


class Finding(NamedTuple):
    """A defect of a recording, with its place in s and what was done about it."""

    level: str
    """``note``, ``warning`` or ``error``."""
    text: str
    """The defect and what was done, in one sentence with units."""
    joint: str
    """The joint; empty for all joints."""
    from_s: float
    """Start of the span, s from the first row."""
    to_s: float
    """End of the span, s from the first row."""


class Reason(NamedTuple):
    """A condition of a certificate that is not met; its text has numbers with units."""

    status: str
    """Name of the condition, such as ``beyond_limits``."""
    condition: str
    """The condition in words."""
    because: str
    """Why, in words and numbers; empty where the condition says it."""


def _structured(time_s: Floats, angles_rad: Floats, joints: Sequence[str], unit: str) -> npt.NDArray[Any]:
    if unit not in ("rad", "deg"):
        raise InputError(f"unit = '{unit}': allowed is rad or deg")
    names = [f"{joint}_{unit}" for joint in joints]
    table = np.empty(len(time_s), dtype=[("time_s", np.float64), *((name, np.float64) for name in names)])
    table["time_s"] = time_s
    for name, column in zip(names, angles_rad.T):
        table[name] = column if unit == "rad" else column * (180.0 / math.pi)
    return table


def _frame(table: npt.NDArray[Any]) -> pandas.DataFrame:
    import pandas

    columns = {name: table[name] for name in table.dtype.names or () if name != "time_s"}
    return pandas.DataFrame(columns, index=pandas.Index(table["time_s"], name="time_s"))


def _warn(findings: Sequence[Finding]) -> None:
    for finding in findings:
        if finding.level != "note":
            warnings.warn(finding.text, RecordingWarning, stacklevel=2)

"""Footfall: gait generators, fits to recordings, certificates, followers, the control loop of the boards, and the virtual board.

Angles are radians, flexion positive; times are seconds; names end with the unit where it is another one. Arrays of four joints have the order of
``JOINTS``: left hip, right hip, left knee, right knee, shape (4,) or (n, 4).
"""

from ._board import Boot, Pulses, Step, Verdict, VirtualBoard
from ._errors import BoardError, FootfallError, InputError, RecordingWarning
from ._footfall import (
    JOINTS,
    Capture,
    Certificate,
    Conditioned,
    Fit,
    Gate,
    Generator,
    JointLoop,
    Recording,
    Servo,
    __version__,
    certify,
    fit,
    gaits,
    read,
    read_capture,
    robot,
    sensor_volts,
    servos,
)
from ._results import Finding, Following, FollowStatus, Inputs, Motion, Outputs, Reason, Tick, Ticks

__all__ = [
    "JOINTS",
    "BoardError",
    "Boot",
    "Capture",
    "Certificate",
    "Conditioned",
    "Finding",
    "Fit",
    "FollowStatus",
    "Following",
    "FootfallError",
    "Gate",
    "Generator",
    "InputError",
    "Inputs",
    "JointLoop",
    "Motion",
    "Outputs",
    "Pulses",
    "Reason",
    "Recording",
    "RecordingWarning",
    "Servo",
    "Step",
    "Tick",
    "Ticks",
    "Verdict",
    "VirtualBoard",
    "__version__",
    "certify",
    "fit",
    "gaits",
    "read",
    "read_capture",
    "robot",
    "sensor_volts",
    "servos",
]

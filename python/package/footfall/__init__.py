"""Footfall: gait generators, fits to recordings, certificates, followers and the control loop of the boards.

Angles are radians, flexion positive; times are seconds; names end with the unit where it is another one. Arrays of four joints have the order of
``JOINTS``: left hip, right hip, left knee, right knee, shape (4,) or (n, 4).
"""

from ._errors import FootfallError, InputError, RecordingWarning
from ._footfall import (
    JOINTS,
    Capture,
    Certificate,
    Conditioned,
    Fit,
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
    "Capture",
    "Certificate",
    "Conditioned",
    "Finding",
    "Fit",
    "FollowStatus",
    "Following",
    "FootfallError",
    "Generator",
    "InputError",
    "Inputs",
    "JointLoop",
    "Motion",
    "Outputs",
    "Reason",
    "Recording",
    "RecordingWarning",
    "Servo",
    "Tick",
    "Ticks",
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

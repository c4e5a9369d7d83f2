"""A simulated body: a planar biped in MuJoCo whose servos are driven by the control loop of the boards.

Install with the extra ``footfall[body]``. ``python -m footfall.body --help`` runs it. Everything that it prints is simulation: nothing of it was
measured on a robot. docs/body.md says what each rig is honest for.
"""

from .board import BoardDriver
from .drivers import Driver, Frame, LoopDriver
from .gait import Gait
from .measures import fallen, hashes, measures, together
from .robots import DESK, MINI, ROBOTS, Foot, Robot, Segment, named, person
from .search import Found, Task, search
from .seeds import Variation, variation
from .simulation import Body, Trace, run

__all__ = [
    "BoardDriver",
    "Body",
    "DESK",
    "Driver",
    "Foot",
    "Found",
    "Frame",
    "Gait",
    "LoopDriver",
    "MINI",
    "ROBOTS",
    "Robot",
    "Segment",
    "Task",
    "Trace",
    "Variation",
    "fallen",
    "hashes",
    "measures",
    "named",
    "person",
    "run",
    "search",
    "together",
    "variation",
]

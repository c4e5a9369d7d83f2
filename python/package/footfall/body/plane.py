"""A search for a gait that walks free in the plane: CMA-ES over stride time, shape and park pose, since the launch is part of such a gait.

A spring holds the lean at first. It becomes softer as the candidates walk, and then there is none; then the robots vary more, and are pushed.
"""

import math
import os
import re
import sys
import tempfile
from dataclasses import dataclass, replace
from typing import Any, Dict, List, Optional, Sequence, Tuple

import numpy as np
import numpy.typing as npt

from .. import JOINTS, robot as servo_maps
from .._errors import FootfallError, InputError
from .by_name import named_robot
from .drivers import LoopDriver
from .gait import Gait, within
from .processes import Processes
from .rollouts import Outcome, Ride, outcomes
from .search import FIRST_SEED, LAST_SEEDS, evolution
from .seeds import variation
from .simulation import Body

Floats = npt.NDArray[np.float64]


def with_park(text: str, park_deg: Sequence[float]) -> str:
    """The text of a robot file with another park pose, deg; comments and all else stay."""
    lines, joint, changed = [], "", 0
    for line in text.splitlines():
        table = re.match(r"\s*\[+\s*([a-z_]+)\s*\]+", line)
        joint = table.group(1) if table else joint
        if joint in JOINTS and re.match(r"\s*park_deg\s*=", line):
            line, changed = f"park_deg = {park_deg[JOINTS.index(joint)]:.2f}", changed + 1
        lines.append(line)
    if changed != len(JOINTS):
        raise InputError(f"the robot file has {changed} lines of park_deg: allowed is one for each joint, as `footfall defaults robot` writes it")
    return "\n".join(lines) + "\n"


#: Of each number of a gait and its park pose: stride time (s), hip and knee, park pose (deg). The search begins with steps of about this size.
SCALE = np.array([0.06, 3.0, 4.0, 2.0, 4.0, 2.0, 4.0, 4.0, 3.0, 2.0, 4.0, 3.0, 2.0, 4.0, 4.0, 4.0, 4.0])
_NUMBERS_OF_GAIT = 13
#: More speed than this earns nothing, m/s: what is left is for standing the pushes.
FAST_M_S = 0.52
#: Root mean square of the motor torque, as a share of the stall torque, from which on it costs.
TORQUE_SHARE = 0.45
#: The spring is softened by this factor when the best five candidates fall in less than a tenth of their runs and walk faster than this, m/s.
_SOFTER, _SOFTEN_M_S = 0.85, 0.3
#: A softer spring than this is none, N m for 1 rad: a 25th of what would hold the robot of 1.2 kg upright.
_NO_SPRING_NM = 0.12


@dataclass(frozen=True)
class Plane:
    """What a candidate is tried on. Units are in the names."""

    robot: str
    """Name of the robot, or its body file; no unit."""
    kind: str
    """Kind of the seeds once there is no spring; no unit."""
    seconds: float
    """Time of a run, s."""
    robot_text: str
    """Robot file with servo map and limits, of which the park pose is changed; no unit."""
    push_ns: float = 0.0
    """Largest push, in half of the runs once there is no spring, N s."""
    slope_deg: float = 0.0
    """Largest slope, up or down, beside that of the seeds, once there is no spring, deg."""
    hold_nm: float = 6.0
    """Stiffness of the spring at the lean in the first generation, N m for 1 rad."""
    servo: Optional[str] = None
    """Another servo than the robot's; no unit."""
    supply_v: Optional[float] = None
    """Another supply than the robot's, V."""


@dataclass(frozen=True)
class Trial:
    """What one run of a candidate is on. Units are in the names."""

    seed: int
    kind: str
    """No unit."""
    hold_nm: float = 0.0
    """N m for 1 rad."""
    slope_deg: float = 0.0
    """Beside that of the seed, deg."""
    push_ns: float = 0.0
    """N s."""


def cost(one: Outcome, seconds: float) -> float:
    """Cost of a run; no unit. Less is better.

    Minus the speed (m/s) up to ``FAST_M_S``, plus 1 for each 1 of torque share above ``TORQUE_SHARE``, and 0.6 to 2.1 for a fall, more for an early
    one. A robot that stands still costs 0.
    """
    value = -min(one.metres / seconds, FAST_M_S) + max(0.0, one.torque_share - TORQUE_SHARE)
    return value + (0.6 + 1.5 * (1.0 - one.seconds / seconds) if one.fallen else 0.0)


def tried(plane: Plane, vector: Any, trials: Sequence[Trial]) -> Tuple[List[Outcome], float]:
    """The outcomes of a candidate, and the share of the control periods in which the gate limits it; no unit."""
    gait, park = Gait.of_vector(vector[:_NUMBERS_OF_GAIT]), vector[_NUMBERS_OF_GAIT:]
    robot, rides = named_robot(plane.robot), []
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "robot.toml")
        with open(file, "w", encoding="utf-8", newline="\n") as writer:
            writer.write(with_park(plane.robot_text, park))
        pulses = LoopDriver.pulses(gait.generator(), plane.seconds, robot=file)
        for trial in trials:
            varied = variation(trial.seed, trial.kind)
            varied = replace(varied, slope_deg=varied.slope_deg + trial.slope_deg)
            body = Body(robot, "free", variation=varied, servo=plane.servo, supply_v=plane.supply_v, robot_file=file)
            rides.append(Ride(body, pulses.frames, trial.push_ns, trial.hold_nm))
    return outcomes(rides, plane.seconds), pulses.limited_share


def _tried(job: Tuple[Plane, Any, Sequence[Trial]]) -> Tuple[List[Outcome], float]:
    return tried(*job)


def _maps(plane: Plane, park_deg: Optional[Sequence[float]] = None) -> Dict[str, Dict[str, float]]:
    """The servo map of the robot file, with another park pose, deg."""
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "robot.toml")
        with open(file, "w", encoding="utf-8", newline="\n") as writer:
            writer.write(plane.robot_text if park_deg is None else with_park(plane.robot_text, park_deg))
        return servo_maps(file)


def _is_allowed(plane: Plane, vector: Floats) -> bool:
    """Whether the stride time and the park pose are allowed; no unit."""
    if not within(Gait.of_vector(vector[:_NUMBERS_OF_GAIT])):
        return False
    try:
        _maps(plane, vector[_NUMBERS_OF_GAIT:].tolist())
    except FootfallError:
        return False
    return True


@dataclass(frozen=True)
class FoundInPlane:
    """What a search found."""

    gait: Gait
    """Units in its names."""
    robot_text: str
    """Robot file with the park pose of the gait; no unit."""
    cost: float
    """Mean over the runs with which the candidates at the end were compared, or over those of the last generation; no unit."""
    falls: int
    """Of these runs; no unit."""
    compared: int
    """Number of these runs; no unit."""
    hold_nm: float
    """Stiffness of the spring at the end, N m for 1 rad; 0 once the candidates walk without."""
    runs: int
    """Simulated runs; no unit."""
    generations: int
    """Generations that ended; no unit."""
    was_stopped: bool = False
    """The keyboard stopped it: the gait is the best candidate of the last generation that ended. No unit."""


def _trials(plane: Plane, drawn: np.random.Generator, seeds: Sequence[int], hold_nm: float) -> List[Trial]:
    """What the candidates of a generation are tried on: with a spring standard robots, then those of the plan, every other one pushed."""
    if hold_nm > 0.0:
        return [Trial(seed, "standard", hold_nm) for seed in seeds]
    slopes = drawn.uniform(-plane.slope_deg, plane.slope_deg, len(seeds)).tolist()
    pushes = drawn.uniform(-plane.push_ns, plane.push_ns, len(seeds)).tolist()
    rows = enumerate(zip(seeds, slopes, pushes))
    return [Trial(seed, plane.kind, 0.0, slope, push if at % 2 else 0.0) for at, (seed, slope, push) in rows]


def search(
    plane: Plane,
    start: Gait,
    *,
    generations: int,
    seeds: int,
    candidates: int,
    random: int,
    step: float,
    jobs: int,
    progress: bool = True,
) -> FoundInPlane:
    """Searches from a gait and the park pose of the robot file on; options as those of ``footfall.body.search``."""
    strategy_of = evolution()
    park_deg = [math.degrees(one["park_rad"]) for one in _maps(plane).values()]
    middle = np.concatenate([start.vector(), park_deg])
    strategy = strategy_of(np.zeros(len(middle)), step, {"popsize": candidates, "seed": random, "verbose": -9})
    drawn = np.random.default_rng(random)
    recent: List[Floats] = []
    hold_nm, runs, ended = plane.hold_nm, 0, 0
    # Of the last of `recent`: its cost, its runs and the spring in them.
    least, spring_nm = math.inf, hold_nm
    of_least: List[Outcome] = []
    try:
        with Processes(jobs) as pool:
            for generation in range(1, generations + 1):
                numbers = [FIRST_SEED + int(seed) for seed in drawn.integers(0, 1_000_000_000, seeds)]
                trials = _trials(plane, drawn, numbers, hold_nm)
                points = strategy.ask()
                vectors = [middle + SCALE * point for point in points]
                allowed = [at for at, vector in enumerate(vectors) if _is_allowed(plane, vector)]
                values = [10.0 + float(np.abs(point).sum()) for point in points]
                results = pool.each(_tried, [(plane, vectors[at], trials) for at in allowed])
                walks = {}
                for at, (found, limited) in zip(allowed, results):
                    values[at] = float(np.mean([cost(one, plane.seconds) for one in found])) + 2.0 * limited
                    walks[at] = found
                runs += len(allowed) * len(trials)
                strategy.tell(points, values)
                order = [at for at in np.argsort(values).tolist() if at in walks]
                if order:
                    recent = [*recent[-4:], vectors[order[0]]]
                    least, of_least, spring_nm = values[order[0]], walks[order[0]], hold_nm
                ended = generation
                best = [one for at in order[:5] for one in walks[at]]
                falls = float(np.mean([one.fallen for one in best])) if best else 1.0
                speed = float(np.mean([one.metres for one in best])) / plane.seconds if best else 0.0
                if progress:
                    done = f"generation {generation} of {generations}: best {min(values):.3f}, median {np.median(values):.3f}"
                    rest = f"spring {hold_nm:.2f} N m, falls of the best {100.0 * falls:.0f} %, {speed:.2f} m/s, step {strategy.sigma:.3f}, {runs} runs"
                    print(f"{done}, {rest}", file=sys.stderr, flush=True)
                if falls < 0.1 and speed > _SOFTEN_M_S:
                    hold_nm = hold_nm * _SOFTER if hold_nm * _SOFTER >= _NO_SPRING_NM else 0.0
            last = [*recent, middle + SCALE * strategy.mean]
            last = [vector for vector in last if _is_allowed(plane, vector)]
            trials = _trials(plane, drawn, LAST_SEEDS, hold_nm)
            compared = list(pool.each(_tried, [(plane, vector, trials) for vector in last]))
            runs += len(last) * len(trials)
    except KeyboardInterrupt:
        if not recent:
            raise
        gait, text = Gait.of_vector(recent[-1][:_NUMBERS_OF_GAIT]), with_park(plane.robot_text, recent[-1][_NUMBERS_OF_GAIT:].tolist())
        return FoundInPlane(gait, text, least, sum(one.fallen for one in of_least), len(of_least), spring_nm, runs, ended, True)
    if not last:
        raise FootfallError("no candidate is allowed: park pose or stride time are at the edge of what is allowed; begin from another one")
    values = [float(np.mean([cost(one, plane.seconds) for one in found])) + 2.0 * limited for found, limited in compared]
    at = int(np.argmin(values))
    gait, text = Gait.of_vector(last[at][:_NUMBERS_OF_GAIT]), with_park(plane.robot_text, last[at][_NUMBERS_OF_GAIT:])
    return FoundInPlane(gait, text, values[at], sum(one.fallen for one in compared[at][0]), len(trials), hold_nm, runs, generations)

"""A search for a gait on the simulated body: CMA-ES over stride time and shape, on robots that vary and a launch that is the board's."""

import math
import sys
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Dict, List, Optional, Sequence, Tuple

import numpy as np

from ._extra import CMA
from .by_name import named_robot
from .drivers import LoopDriver
from .gait import Gait, within
from .measures import fallen, measures
from .processes import Processes
from .seeds import variation
from .simulation import Body, run

#: Seeds of the search begin here; `--seeds` of the other commands ends before.
FIRST_SEED = 1_000_000
#: The seeds with which the candidates at the end are compared: none of the search.
LAST_SEEDS = range(900_000, 900_008)
#: Of each number of a gait: stride time (s), hip and knee (deg). The search begins with steps of about this size.
_SCALE = np.array([0.08, 3.0, 4.0, 2.0, 4.0, 2.0, 4.0, 4.0, 3.0, 2.0, 4.0, 3.0, 2.0])

#: Root mean square of the motor torque, as a share of the stall torque, from which on it costs.
TORQUE_SHARE = 0.34
#: Slip from which on it costs, m in a second.
SLIP_M_S = 0.009


@dataclass(frozen=True)
class Task:
    """What a candidate is tried on. Units are in the names."""

    robot: str
    """Name of the robot, or its body file; no unit."""
    rig: str
    """No unit."""
    kind: str
    """Kind of the seeds; no unit."""
    seconds: float
    """Time of a run, s."""
    robot_file: Optional[str] = None
    """Robot file with servo map and limits; no unit."""
    servo: Optional[str] = None
    """Another servo than the robot's; no unit."""
    supply_v: Optional[float] = None
    """Another supply than the robot's, V."""


def cost(one: Dict[str, Any], seconds: float) -> float:
    """Cost of a run; no unit. Less is better.

    Minus the speed (m/s), plus 3 for each 1 of torque share above ``TORQUE_SHARE``, 10 for each m/s of slip above ``SLIP_M_S``, 2 for each 1 of the
    share of control periods in which the gate limits, and 1 to 3 for a fall, more for an early one. A pattern that stands still costs 0.
    """
    value = -one["metres"] / seconds
    value += 3.0 * max(0.0, one["torque_share"] - TORQUE_SHARE) + 10.0 * max(0.0, one["slip_m"] / seconds - SLIP_M_S)
    value += 2.0 * one["limited_share"]
    if one["fallen"]:
        value += 1.0 + 2.0 * (1.0 - one["seconds"] / seconds)
    return float(value)


def _body(task: Task, seed: int) -> Body:
    robot, varied = named_robot(task.robot), variation(seed, task.kind)
    return Body(robot, task.rig, variation=varied, servo=task.servo, supply_v=task.supply_v, robot_file=task.robot_file)


def tried(task: Task, vector: Any, seed: int) -> Dict[str, Any]:
    """The run of a candidate on the robot of a seed: its measures (units in their names) and its ``cost``."""
    body = _body(task, seed)
    driver = LoopDriver(Gait.of_vector(vector).generator(), robot=task.robot_file)
    trace = run(body, driver, task.seconds, seed=seed, until=fallen)
    one = measures(trace, bool(fallen(body)) or driver.stopped is not None)
    one["torque_share"] = max(one["motor_rms_nm"]) / body.servos[0].servo.stall_nm
    one["limited_share"] = driver.limited_share
    one["cost"] = cost(one, task.seconds)
    return one


def _tried(job: Tuple[Task, Any, int]) -> float:
    return float(tried(*job)["cost"])


def evolution() -> Any:
    """The class of CMA-ES, or an ``ImportError`` that says what to install."""
    try:
        return import_module("cma").CMAEvolutionStrategy
    except ImportError as error:
        raise ImportError(f"`search` needs cma {CMA}, which is not installed: pip install 'footfall[body]', or ./python[body] in a clone") from error


@dataclass(frozen=True)
class Found:
    """What a search found."""

    gait: Gait
    """Units in its names."""
    cost: float
    """Mean over the seeds with which the candidates at the end were compared, or over those of the last generation; no unit."""
    runs: int
    """Simulated runs; no unit."""
    generations: int
    """Generations that ended; no unit."""
    was_stopped: bool = False
    """The keyboard stopped it: the gait is the best candidate of the last generation that ended. No unit."""


def search(
    task: Task, start: Gait, *, generations: int, seeds: int, candidates: int, random: int, step: float, jobs: int, progress: bool = True
) -> Found:
    """Searches from a gait on; ``seeds`` robots for each candidate, new ones in each generation, so that no robot is learnt by heart.

    ``step``: the first standard deviation, as a factor (no unit) of 0.08 s and 2 to 4 deg. ``random``: the seed of the search; the same one gives the
    same gait. At the end the middle of the distribution and the best candidates of the last generations are compared on 8 other robots. The keyboard
    (``KeyboardInterrupt``) stops it with what it has, once a generation has ended.
    """
    strategy_of = evolution()
    # A wrong name or value is an error here, not in each process.
    _body(task, FIRST_SEED)
    middle = start.vector()
    strategy = strategy_of(np.zeros(len(middle)), step, {"popsize": candidates, "seed": random, "verbose": -9})
    drawn = np.random.default_rng(random)
    recent: List[Any] = []
    runs, ended, least = 0, 0, math.inf
    try:
        with Processes(jobs) as pool:

            def means(vectors: Sequence[Any], numbers: Sequence[int]) -> List[float]:
                work = [(task, vector, seed) for vector in vectors for seed in numbers]
                costs = list(pool.each(_tried, work, chunksize=max(1, len(numbers) // 4)))
                return [float(np.mean(costs[at : at + len(numbers)])) for at in range(0, len(costs), len(numbers))]

            for generation in range(1, generations + 1):
                numbers = [FIRST_SEED + int(seed) for seed in drawn.integers(0, 1_000_000_000, seeds)]
                points = strategy.ask()
                vectors = [middle + _SCALE * point for point in points]
                allowed = [vector for vector in vectors if within(Gait.of_vector(vector))]
                costs = iter(means(allowed, numbers))
                runs += len(allowed) * len(numbers)
                values = [next(costs) if within(Gait.of_vector(vector)) else 10.0 + abs(math.log(max(vector[0], 1e-3))) for vector in vectors]
                strategy.tell(points, values)
                best = int(np.argmin(values))
                recent, least, ended = [*recent[-4:], vectors[best]], values[best], generation
                if progress:
                    done = f"generation {generation} of {generations}: best {values[best]:.3f}, median {np.median(values):.3f}"
                    print(f"{done}, step {strategy.sigma:.3f}, {runs} runs", file=sys.stderr, flush=True)
            last = [*recent, middle + _SCALE * strategy.result.xfavorite]
            last = [vector for vector in last if within(Gait.of_vector(vector))]
            values = means(last, list(LAST_SEEDS))
            runs += len(last) * len(LAST_SEEDS)
    except KeyboardInterrupt:
        if not recent or not within(Gait.of_vector(recent[-1])):
            raise
        return Found(Gait.of_vector(recent[-1]), least, runs, ended, True)
    best = int(np.argmin(values))
    return Found(Gait.of_vector(last[best]), values[best], runs, generations)

"""Feedback from the body to the pattern, free in the plane: what a foot switch and the joints' sensors can change, once in each servo frame.

A trial of this package, not of the boards: the laws act on the phase and on the targets of an open-loop gait, and use only what a board measures.
The pulses without feedback are those of a board, rounding included, as long as the gate does not limit.
"""

import math
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Dict, List, Sequence, Tuple

import numpy as np
import numpy.typing as npt

from .. import JOINTS
from .._errors import FootfallError
from .gait import Gait
from .measures import FALLEN_RAD, FALLEN_SHARE
from .robots import Robot
from .rollouts import Outcome, Ride, model
from .seeds import variation
from .simulation import PUSH_AT_S, PUSH_S, Body, Path

Floats = npt.NDArray[np.float64]

#: The board's servo frame, ms.
FRAME_MS = 20
#: Time of the ramp from the park pose, s, and the age of the ramp and of the generator at the first servo frame, as `LoopDriver` arms, s.
_RAMP_S, _RAMP_AGE_S, _GENERATOR_AGE_S = 2.0, 0.010, 0.719
#: Feedback begins with the ramp's end, s.
_FROM_S = 2.0
#: A foot switch closes at this force, N: a tenth of the desk robot's weight.
SWITCH_N = 1.2
#: A contact counts if the switch was open for so long before, ms, and the last one that counts is half a stride ago: feet bounce and scuff.
_OPEN_MS = 50
#: Steps of a ladder: pushes (N s) and slopes (deg).
PUSH_STEP_NS, SLOPE_STEP_DEG = 0.05, 0.5
#: Rungs of a ladder.
RUNGS = 12


@dataclass(frozen=True)
class Law:
    """How a contact of the left heel and the joints' angles change the pattern. All zero: no feedback. Units are in the names."""

    reset: float = 0.0
    """Share of the phase's error that a heel contact takes away; no unit."""
    hip_deg: float = 0.0
    """Added to both hips until the next heel contact, for each cycle that the contact is early, deg."""
    stiffer: float = 0.0
    """Share of each joint's distance to its last target that is added to the next one: above 0 stiffer, below 0 softer; no unit."""


#: The laws that are compared.
LAWS: Dict[str, Law] = {
    "none": Law(),
    "reset 0.25": Law(reset=0.25),
    "reset 0.5": Law(reset=0.5),
    "reset 1": Law(reset=1.0),
    "hip +20 deg": Law(hip_deg=20.0),
    "hip +60 deg": Law(hip_deg=60.0),
    "hip -20 deg": Law(hip_deg=-20.0),
    "stiffer 0.3": Law(stiffer=0.3),
    "softer 0.3": Law(stiffer=-0.3),
    "reset 0.5, hip +20 deg": Law(reset=0.5, hip_deg=20.0),
}


def _ramp(age_s: float) -> float:
    """The board's minimum-jerk profile; no unit."""
    x = min(1.0, max(0.0, age_s / _RAMP_S))
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


def _pattern(gait: Gait, cycles: Floats) -> Floats:
    """Angles of the joints at some phases, shape (n, 4), rad."""
    columns = []
    for _, cosines, sines in gait.joints():
        turns = 2.0 * math.pi * np.outer(cycles, np.arange(1, len(sines) + 1))
        columns.append(np.radians(cosines[0] + np.cos(turns) @ cosines[1:] + np.sin(turns) @ sines))
    return np.stack(columns, axis=1)


def closed(
    rides: Sequence[Ride], gait: Gait, law: Law, seconds: float, heel_cycles: float = 0.0
) -> Tuple[List[Outcome], List[List[float]]]:
    """The outcomes of runs with feedback, time in s, and the phases (cycles) of the heel contacts of each; torque is not measured.

    ``heel_cycles``: the phase that a heel contact should have, in cycles.
    """
    module, rollout = import_module("mujoco"), import_module("mujoco.rollout")
    models = [model(ride, module, foot=True) for ride in rides]
    first, full, count = rides[0].body, module.mjtState.mjSTATE_FULLPHYSICS, len(rides)
    states, data = np.zeros((count, module.mj_stateSize(models[0], full))), module.MjData(models[0])
    for state, one, ride in zip(states, models, rides):
        module.mj_resetData(one, data)
        data.qpos[:] = ride.body.data.qpos
        module.mj_getState(one, data, state, full)
    at, (x, z, lean) = 1 + first.angle_places, (1 + first.trunk_places[name] for name in ("x", "z", "pitch"))
    maps = np.array([(one.neutral_us, one.at_neutral_rad, one.us_per_rad) for one in first.servos])
    neutral_us, at_neutral_rad, us_per_rad = maps.T
    park = np.array([first.park_rad] * count)
    trims = np.array([[mounted.trim_rad for mounted in ride.body.servos] for ride in rides])
    least, most = first.limits_rad
    pushes = np.array([ride.push_ns / PUSH_S for ride in rides])
    cycles, offset = np.full(count, _GENERATOR_AGE_S / gait.stride_s), np.zeros(count)
    last, open_ms, since_ms = park.copy(), np.zeros(count), np.full(count, 1e9)
    metres, ends, fallen = np.zeros(count), np.full(count, seconds), np.zeros(count, dtype=bool)
    heels: List[List[float]] = [[] for _ in rides]
    up, frames = np.arange(count), round(seconds * 1000.0 / FRAME_MS)
    with rollout.Rollout(nthread=0) as pool:
        for frame in range(frames):
            time_s = frame * FRAME_MS / 1000.0
            pattern = _pattern(gait, cycles)
            pattern[:, :2] += offset[:, None]
            weight = _ramp(time_s + _RAMP_AGE_S)
            target = weight * pattern + (1.0 - weight) * park[up]
            if time_s >= _FROM_S:
                target = target + law.stiffer * (last - states[:, at])
            target = np.clip(target, least, most)
            widths = np.round(neutral_us + (target - at_neutral_rad) * us_per_rad)
            target = at_neutral_rad + (widths - neutral_us) / us_per_rad
            # A servo knows the width of a pulse at its end.
            is_new = np.arange(FRAME_MS)[None, :, None] >= np.ceil(widths / 1000.0)[:, None, :]
            goals = np.where(is_new, target[:, None], last[:, None]) - trims[up][:, None]
            control = np.zeros((len(up), FRAME_MS, 2 * len(JOINTS) + 1))
            control[:, :, :-1] = np.repeat(goals, 2, axis=2)
            moments_s = time_s + np.arange(FRAME_MS) / 1000.0
            control[:, :, -1] = pushes[up][:, None] * ((moments_s >= PUSH_AT_S) & (moments_s < PUSH_AT_S + PUSH_S))
            out, felt = pool.rollout([models[one] for one in up], data, states, control)
            states, force = out[:, -1], felt[:, :, 0]
            # The switch is read in each millisecond, as by the boards; the pattern is changed from the next servo frame on.
            closed_at = force > SWITCH_N
            first_ms = np.where(closed_at.any(axis=1), closed_at.argmax(axis=1), FRAME_MS)
            counts = (first_ms < FRAME_MS) & (open_ms + first_ms >= _OPEN_MS) & (since_ms + first_ms >= 500.0 * gait.stride_s)
            open_ms = np.where(closed_at.any(axis=1), closed_at[:, ::-1].argmax(axis=1), open_ms + FRAME_MS)
            since_ms = np.where(counts, 0.0 - first_ms, since_ms) + FRAME_MS
            if time_s >= _FROM_S:
                phases = cycles + (first_ms + 1) / 1000.0 / gait.stride_s
                for row in np.flatnonzero(counts).tolist():
                    heels[up[row]].append(float(phases[row] % 1.0))
                errors = np.where(counts, (heel_cycles - phases + 0.5) % 1.0 - 0.5, 0.0)
                # Early: the pattern is not yet where it should be, and is put forward.
                cycles = cycles + law.reset * errors
                offset = np.where(counts, math.radians(law.hip_deg) * errors, offset)
            cycles, last = cycles + FRAME_MS / 1000.0 / gait.stride_s, target
            metres[up] = states[:, x]
            lies = (states[:, z] < (FALLEN_SHARE - 1.0) * first.robot.hip_m) | (np.abs(states[:, lean]) > FALLEN_RAD)
            fallen[up[lies]], ends[up[lies]] = True, time_s + FRAME_MS / 1000.0
            stays = ~lies
            states, cycles, offset, last, up = states[stays], cycles[stays], offset[stays], last[stays], up[stays]
            open_ms, since_ms = open_ms[stays], since_ms[stays]
            if not len(up):
                break
    found = zip(metres.tolist(), ends.tolist(), fallen.tolist())
    return [Outcome(way, end, lies, math.nan) for way, end, lies in found], heels


@dataclass(frozen=True)
class Limits:
    """What each of some robots stands with a law. Lists have one entry for each robot; units are in the names."""

    forwards_ns: List[float]
    """Largest push forwards from which it recovers, all smaller ones too, N s."""
    backwards_ns: List[float]
    """The same backwards, N s."""
    up_deg: List[float]
    """Steepest slope that it walks up, all flatter ones too, deg."""
    down_deg: List[float]
    """The same downwards, deg."""


def _rides(gait: Gait, robot: Robot, robot_file: Path, seeds: Sequence[int], kind: str, slope_deg: float, push_ns: float) -> List[Ride]:
    found = []
    for seed in seeds:
        varied = variation(seed, kind)
        varied = replace(varied, slope_deg=varied.slope_deg + slope_deg)
        found.append(Ride(Body(robot, "free", variation=varied, robot_file=robot_file), (), push_ns))
    return found


def heel_phase(gait: Gait, robot: Robot, robot_file: Path, seconds: float = 6.0) -> float:
    """The phase at which the left heel of the nominal robot meets a level floor without feedback, in cycles; the mean on the circle."""
    _, (phases,) = closed(_rides(gait, robot, robot_file, [0], "standard", 0.0, 0.0), gait, Law(), seconds)
    if not phases:
        raise FootfallError("the left heel of the nominal robot has no contact after the ramp: the gait does not walk free in the plane")
    turns = np.exp(2j * math.pi * np.array(phases))
    return float(np.angle(turns.mean()) / (2.0 * math.pi) % 1.0)


def limits(
    gait: Gait, robot: Robot, robot_file: Path, law: Law, seeds: Sequence[int], kind: str, *, heel_cycles: float, seconds: float = 10.0
) -> Limits:
    """What the robots of some seeds stand with a law, by ladders of ``RUNGS`` steps; a robot that falls undisturbed has 0."""

    def climbed(slope_deg: float, push_ns: float) -> List[float]:
        rungs, left = dict.fromkeys(seeds, 0), list(seeds)
        for rung in range(RUNGS + 1):
            if not left:
                break
            found, _ = closed(_rides(gait, robot, robot_file, left, kind, rung * slope_deg, rung * push_ns), gait, law, seconds, heel_cycles)
            left = [seed for seed, one in zip(left, found) if not one.fallen]
            rungs.update(dict.fromkeys(left, rung))
        return [rungs[seed] * (abs(slope_deg) + abs(push_ns)) for seed in seeds]

    ladders = (0.0, PUSH_STEP_NS), (0.0, -PUSH_STEP_NS), (SLOPE_STEP_DEG, 0.0), (-SLOPE_STEP_DEG, 0.0)
    return Limits(*(climbed(*ladder) for ladder in ladders))


def interval(values: Sequence[float], random: int = 1) -> Tuple[float, float, float]:
    """Mean and the 95 % interval of its bootstrap (10000 draws with replacement, percentiles); unit of the values."""
    given = np.array(values, dtype=np.float64)
    draws = np.random.default_rng(random).integers(0, len(given), (10_000, len(given)))
    low, high = np.percentile(given[draws].mean(axis=1), [2.5, 97.5])
    return float(given.mean()), float(low), float(high)

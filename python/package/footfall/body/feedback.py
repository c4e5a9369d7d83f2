"""Feedback from the body to the pattern, free in the plane: what a foot switch and the joints' sensors can change, once in each servo frame.

A trial of this package, not of the boards: the laws act on the phase and on the targets of an open-loop gait, before the gate of the boards, from a
foot switch and the exact angles of the joints; a board measures angles with noise. The pulses without feedback are those of a board,
within 1 us in 1 of 100 servo frames.
"""

import math
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Dict, List, Optional, Sequence, Tuple

import numpy as np
import numpy.typing as npt

from .. import JOINTS, Gate, Generator
from .._errors import FootfallError, InputError
from .drivers import LoopDriver
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
_RAMP_S, _RAMP_AGE_S, _GENERATOR_AGE_S = 2.0, 0.011, 0.719
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
    """How a contact of the left heel and the joints' angles change the pattern. All zero: no feedback. Units are in the names.

    Early by x cycles is a contact at a phase of the pattern that is x before the phase of the contacts of an undisturbed nominal robot.
    """

    reset: float = 0.0
    """Share of the phase's error that a heel contact takes away; no unit."""
    hip_deg: float = 0.0
    """Added to both hips until the next heel contact, for each cycle that the contact is early, deg."""
    step: float = 0.0
    """Share by which the hips' motion about its mean grows until the next heel contact, for each cycle that the contact is early; no unit."""
    knee_deg: float = 0.0
    """Added to both knees until the next heel contact, for each cycle that the contact is early, deg."""
    hips: float = 0.0
    """Share of each hip's distance to its last setpoint that is added to the next target: above 0 stiffer, below 0 softer; no unit."""
    knees: float = 0.0
    """The same of the knees; no unit."""


#: The laws that are compared with the first one, each at two strengths. The gains of the last ones are those of a search with CMA-ES over all six, on
#: robots of seeds from 1,000,000 on, with pushes and slopes at which the gait falls without feedback; it was stopped after a few generations.
LAWS: Dict[str, Law] = {
    "none": Law(),
    "reset 0.25": Law(reset=0.25),
    "reset 0.5": Law(reset=0.5),
    "hip +20 deg": Law(hip_deg=20.0),
    "hip -20 deg": Law(hip_deg=-20.0),
    "hips softer 0.35": Law(hips=-0.35),
    "hips softer 0.7": Law(hips=-0.7),
    "knees stiffer 0.3": Law(knees=0.3),
    "knees stiffer 0.6": Law(knees=0.6),
    "hips softer 0.35, knees stiffer 0.3": Law(hips=-0.35, knees=0.3),
    "hips softer 0.7, knees stiffer 0.6": Law(hips=-0.7, knees=0.6),
    "all, half": Law(reset=-0.05, hip_deg=-13.5, step=-0.1, knee_deg=-4.25, hips=-0.37, knees=0.29),
    "all": Law(reset=-0.1, hip_deg=-27.0, step=-0.2, knee_deg=-8.5, hips=-0.74, knees=0.58),
}


def gait_of(generator: Generator, robot_file: Optional[Path]) -> Gait:
    """The gait of a generator, which the laws change; ``InputError`` if its pulses differ by more than 1 us from the generator's in 4 s."""
    gait = Gait.of(generator)
    both = [LoopDriver.pulses(one, 4.0, robot=robot_file).frames for one in (generator, gait.generator())]
    apart_us = max(abs(ours - theirs) for one, other in zip(*both) for ours, theirs in zip(one.us, other.us))
    if apart_us > 1.0:
        raise InputError(
            f"the pulses of this generator differ by up to {apart_us:g} us from those of its left leg's first harmonics: allowed is a gait whose legs do the "
            "same half a stride apart, with two harmonics at the hips and three at the knees, as `search` writes one"
        )
    return gait


def _ramp(age_s: Floats) -> Floats:
    """The board's minimum-jerk profile; no unit."""
    x = np.clip(age_s / _RAMP_S, 0.0, 1.0)
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


def _pattern(gait: Gait, cycles: Floats) -> Floats:
    """Angles of the joints at phases (cycles) of any shape, with one axis more, of length 4, rad."""
    columns = []
    for _, cosines, sines in gait.joints():
        turns = 2.0 * math.pi * np.multiply.outer(cycles, np.arange(1, len(sines) + 1))
        columns.append(np.radians(cosines[0] + np.cos(turns) @ cosines[1:] + np.sin(turns) @ sines))
    return np.stack(columns, axis=-1)


def shaped(law: Law, gait: Gait, pattern: Floats, early_cycles: Floats) -> Floats:
    """A pattern, shape (n, ms, 4), rad, after contacts that were early by ``early_cycles``, shape (n,); rad."""
    early, found = early_cycles[:, None, None], pattern.copy()
    hips = pattern[..., :2]
    found[..., :2] += early * (math.radians(law.hip_deg) + law.step * (hips - math.radians(gait.hip_deg[0])))
    found[..., 2:] += early * math.radians(law.knee_deg)
    return found


def pressed(law: Law, targets: Floats, setpoints: Floats, angles: Floats) -> Floats:
    """Targets, shape (n, ms, 4), for joints that are at angles and should be at setpoints, shape (n, 4); all in rad."""
    shares = np.array([law.hips, law.hips, law.knees, law.knees])
    return targets + (shares * (setpoints - angles))[:, None]


@dataclass(frozen=True)
class Closed:
    """What came of runs with feedback; lists have one entry for each run. Units are in the names."""

    outcomes: List[Outcome]
    """The torque is not measured; units in its names."""
    heel_cycles: List[List[float]]
    """Phases of the heel contacts after the ramp, cycles."""
    limited_share: float
    """Share of the control periods of all runs in which the gate changed a setpoint; no unit."""


def closed(
    rides: Sequence[Ride], gait: Gait, law: Law, seconds: float, *, robot_file: Optional[Path], heel_cycles: float = 0.0
) -> Closed:
    """Runs with feedback for a time, s. ``heel_cycles``: the phase that a heel contact should have, in cycles.

    The law changes the targets once in each servo frame; the gate of the robot file limits them in each control period of 1 ms.
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
    gates = [Gate(robot_file) for _ in rides]
    millis, limited, periods = np.arange(FRAME_MS) / 1000.0, 0, 0
    trims = np.array([[mounted.trim_rad for mounted in ride.body.servos] for ride in rides])
    pushes = np.array([ride.push_ns / PUSH_S for ride in rides])
    cycles, early = np.full(count, _GENERATOR_AGE_S / gait.stride_s), np.zeros(count)
    last, open_ms, since_ms = park.copy(), np.zeros(count), np.full(count, 1e9)
    metres, ends, fallen = np.zeros(count), np.full(count, seconds), np.zeros(count, dtype=bool)
    heels: List[List[float]] = [[] for _ in rides]
    up, frames = np.arange(count), round(seconds * 1000.0 / FRAME_MS)
    with rollout.Rollout(nthread=0) as pool:
        for frame in range(frames):
            time_s = frame * FRAME_MS / 1000.0
            pattern = shaped(law, gait, _pattern(gait, cycles[:, None] + millis / gait.stride_s), early)
            weight = _ramp(time_s + _RAMP_AGE_S + millis)[:, None]
            targets = weight * pattern + (1.0 - weight) * park[up][:, None]
            if time_s >= _FROM_S:
                targets = pressed(law, targets, last, states[:, at])
            gated = [gates[one].limit(rows) for one, rows in zip(up.tolist(), targets)]
            limited, periods = limited + sum(int(np.count_nonzero(bits)) for _, bits in gated), periods + FRAME_MS * len(gated)
            # The pulses of a servo frame are those of its first control period.
            target = np.array([setpoints[0] for setpoints, _ in gated], dtype=np.float64)
            widths = np.round(neutral_us + (target - at_neutral_rad) * us_per_rad)
            target = at_neutral_rad + (widths - neutral_us) / us_per_rad
            # A servo knows the width of a pulse at its end.
            is_new = np.arange(FRAME_MS)[None, :, None] >= np.ceil(widths / 1000.0)[:, None, :]
            goals = np.where(is_new, target[:, None], last[:, None]) - trims[up][:, None]
            control = np.zeros((len(up), FRAME_MS, 2 * len(JOINTS) + 1))
            control[:, :, :-1] = np.repeat(goals, 2, axis=2)
            moments_s = time_s + millis
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
                early = np.where(counts, errors, early)
            cycles, last = cycles + FRAME_MS / 1000.0 / gait.stride_s, target
            metres[up] = states[:, x]
            lies = (states[:, z] < (FALLEN_SHARE - 1.0) * first.robot.hip_m) | (np.abs(states[:, lean]) > FALLEN_RAD)
            fallen[up[lies]], ends[up[lies]] = True, time_s + FRAME_MS / 1000.0
            stays = ~lies
            states, cycles, early, last, up = states[stays], cycles[stays], early[stays], last[stays], up[stays]
            open_ms, since_ms = open_ms[stays], since_ms[stays]
            if not len(up):
                break
    found = zip(metres.tolist(), ends.tolist(), fallen.tolist())
    return Closed([Outcome(way, end, lies, math.nan) for way, end, lies in found], heels, limited / max(periods, 1))


#: What is climbed: name, slope (deg) and push (N s) of a rung.
LADDERS: Dict[str, Tuple[float, float]] = {
    "forwards_ns": (0.0, PUSH_STEP_NS),
    "backwards_ns": (0.0, -PUSH_STEP_NS),
    "up_deg": (SLOPE_STEP_DEG, 0.0),
    "down_deg": (-SLOPE_STEP_DEG, 0.0),
}


@dataclass(frozen=True)
class Limits:
    """What each of some robots stands with a law. Lists have one entry for each robot; units are in the names."""

    fallen: List[bool]
    """Whether it falls undisturbed on the level; it then stands 0 of the others. No unit."""
    forwards_ns: List[float]
    """Largest push forwards from which it recovers, all smaller ones too, N s."""
    backwards_ns: List[float]
    """The same backwards, N s."""
    up_deg: List[float]
    """Steepest slope that it walks up, all flatter ones too, deg."""
    down_deg: List[float]
    """The same downwards, deg."""
    limited_share: float
    """Share of the control periods of the undisturbed runs in which the gate changed a setpoint; no unit."""

    def at_the_top(self, name: str) -> int:
        """How many robots stand the last rung of a ladder; no unit."""
        most = RUNGS * sum(map(abs, LADDERS[name]))
        return sum(value > 0.999 * most for value in getattr(self, name))


def _rides(gait: Gait, robot: Robot, robot_file: Path, seeds: Sequence[int], kind: str, slope_deg: float, push_ns: float) -> List[Ride]:
    found = []
    for seed in seeds:
        varied = variation(seed, kind)
        varied = replace(varied, slope_deg=varied.slope_deg + slope_deg)
        found.append(Ride(Body(robot, "free", variation=varied, robot_file=robot_file), (), push_ns))
    return found


def heel_phase(gait: Gait, robot: Robot, robot_file: Path, seconds: float = 6.0) -> float:
    """The phase at which the left heel of the nominal robot meets a level floor without feedback, in cycles; the mean on the circle."""
    (phases,) = closed(_rides(gait, robot, robot_file, [0], "standard", 0.0, 0.0), gait, Law(), seconds, robot_file=robot_file).heel_cycles
    if not phases:
        raise FootfallError("the left heel of the nominal robot has no contact after the ramp: the gait does not walk free in the plane")
    turns = np.exp(2j * math.pi * np.array(phases))
    return float(np.angle(turns.mean()) / (2.0 * math.pi) % 1.0)


def limits(
    gait: Gait,
    robot: Robot,
    robot_file: Path,
    law: Law,
    seeds: Sequence[int],
    kind: str,
    *,
    heel_cycles: float,
    seconds: float = 10.0,
    rungs: int = RUNGS,
) -> Limits:
    """What the robots of some seeds stand with a law, by ladders of some rungs, each from the level and the first push on."""

    def rode(rides: Sequence[Ride]) -> Closed:
        return closed(rides, gait, law, seconds, robot_file=robot_file, heel_cycles=heel_cycles)

    plain = rode(_rides(gait, robot, robot_file, seeds, kind, 0.0, 0.0))
    fallen = [one.fallen for one in plain.outcomes]
    stood = {name: dict.fromkeys(seeds, 0) for name in LADDERS}
    left = [(name, seed) for name in LADDERS for seed, falls in zip(seeds, fallen) if not falls]
    for rung in range(1, rungs + 1):
        if not left:
            break
        rides = [_rides(gait, robot, robot_file, [seed], kind, *(rung * size for size in LADDERS[name]))[0] for name, seed in left]
        left = [one for one, outcome in zip(left, rode(rides).outcomes) if not outcome.fallen]
        for name, seed in left:
            stood[name][seed] = rung
    found = {name: [rung * sum(map(abs, LADDERS[name])) for rung in stood[name].values()] for name in LADDERS}
    return Limits(fallen, limited_share=plain.limited_share, **found)


def interval(values: Sequence[float], random: int = 1) -> Tuple[float, float, float]:
    """Mean and the 95 % interval of its bootstrap (10000 draws with replacement, percentiles); unit of the values."""
    given = np.array(values, dtype=np.float64)
    draws = np.random.default_rng(random).integers(0, len(given), (10_000, len(given)))
    low, high = np.percentile(given[draws].mean(axis=1), [2.5, 97.5])
    return float(given.mean()), float(low), float(high)


#: A bootstrap of fewer robots than this says nothing of other robots, so there is no interval.
LEAST_ROBOTS = 10


def _cell(values: Sequence[float], digits: int, sign: str = "") -> str:
    """Mean and interval of some robots as the tables have them; unit of the values."""
    mean, low, high = interval(values)
    span = f"{low:{sign}.{digits}f} to {high:{sign}.{digits}f}" if len(values) >= LEAST_ROBOTS else "-"
    return f"{mean:{sign}.{digits}f} ({span})"


#: Of each ladder: what the tables call it, and digits behind the point.
_NAMES = {"forwards_ns": ("push forwards N s", 3), "backwards_ns": ("push backwards N s", 3), "up_deg": ("slope up deg", 2), "down_deg": ("slope down deg", 2)}


def _differences(one: Limits, none: Limits, ladder: str) -> List[float]:
    return [ours - theirs for ours, theirs in zip(getattr(one, ladder), getattr(none, ladder))]


def gain(one: Limits, none: Limits) -> Dict[str, Tuple[float, Optional[float], Optional[float]]]:
    """Mean and interval of the differences, robot by robot, of a law to none for each ladder; N s and deg. No interval below ``LEAST_ROBOTS``."""
    found: Dict[str, Tuple[float, Optional[float], Optional[float]]] = {}
    for name in LADDERS:
        mean, low, high = interval(_differences(one, none, name))
        found[name] = (mean, low, high) if len(one.fallen) >= LEAST_ROBOTS else (mean, None, None)
    return found


def row(name: str, one: Limits) -> str:
    """The line of a law in the table of what the robots stand; N s, deg."""
    cells = [f"{sum(one.fallen)} of {len(one.fallen)}", f"{100.0 * one.limited_share:.1f}"]
    for ladder, (_, digits) in _NAMES.items():
        cells.append(f"{_cell(getattr(one, ladder), digits)}, {one.at_the_top(ladder)}")
    return f"| {name} | " + " | ".join(cells) + " |"


def gain_row(name: str, one: Limits, none: Limits) -> str:
    """The line of a law in the table of the differences to none; N s, deg."""
    cells = (_cell(_differences(one, none, ladder), digits, "+") for ladder, (_, digits) in _NAMES.items())
    return f"| {name} | " + " | ".join(cells) + " |"


def tables(stood: Dict[str, Limits]) -> List[str]:
    """Both tables in Markdown: what the robots stand with each law, ``none`` among them, and its differences to none; N s and deg."""

    def head(*cells: str) -> List[str]:
        return [f"| {' | '.join(cells)} |", "| --- " * len(cells) + "|"]

    names = [name for name, _ in _NAMES.values()]
    lines = head("law", "falls undisturbed", "gate limits, % of the time", *(f"{name}: mean (95 % interval), at the top" for name in names))
    lines += [row(name, one) for name, one in stood.items()]
    lines += ["", *head("law less none, robot by robot", *(f"{name} (95 % interval)" for name in names))]
    return lines + [gain_row(name, one, stood["none"]) for name, one in stood.items() if name != "none"]

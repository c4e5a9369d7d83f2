"""Feedback of the knees as the boards have it: how many robots stand a push or a slope with the control loop, with and without a share.

Unlike ``feedback``, nothing here is computed beside the control loop: the robot file has the share, and the loop has the sensors of both knees with their
noise, its filter, its servo frames and its gate.
"""

import math
import os
import re
import sys
import tempfile
from dataclasses import dataclass, replace
from typing import Dict, List, Optional, Sequence, Tuple

from .. import Generator
from .._errors import FootfallError, InputError
from .drivers import LoopDriver
from .measures import fallen
from .robots import Robot
from .seeds import variation
from .sensor import Path
from .simulation import Body, run

#: What the robots meet: name, slope (deg) and push (N s), near the largest that robots stand by `feedback`.
TRIALS: Dict[str, Tuple[float, float]] = {
    "undisturbed": (0.0, 0.0),
    "push 0.30 N s forwards": (0.0, 0.30),
    "push 0.30 N s backwards": (0.0, -0.30),
    "push 0.35 N s backwards": (0.0, -0.35),
    "slope 1.5 deg up": (1.5, 0.0),
    "slope 1.5 deg down": (-1.5, 0.0),
}

#: Joints with feedback, and with a sensor in both runs.
KNEES: Tuple[Tuple[str, Optional[Path]], ...] = (("left_knee", None), ("right_knee", None))


def with_share(robot_text: str, share: float) -> str:
    """The text of a robot file with this feedback at both knees, no unit, and at no other joint."""
    text = re.sub(r"(?m)^feedback *=.*\n", "", robot_text)
    for joint, _ in KNEES if share else ():
        text, changed = re.subn(rf"(?m)^\[{joint}\].*$", rf"\g<0>\nfeedback = {share:g}", text)
        if changed != 1:
            raise InputError(f"the robot file has {changed} tables [{joint}]: allowed is one, as `footfall defaults robot` writes it")
    return text


@dataclass(frozen=True)
class Trial:
    """What came of the runs of one trial. Lists have one entry for each robot."""

    without: List[bool]
    """Whether it stands without feedback; no unit."""
    with_share: List[bool]
    """Whether it stands with it; no unit."""
    limited_share: float
    """Share of the control periods with feedback in which the gate changed a setpoint; no unit."""

    @property
    def only_with(self) -> int:
        """Robots that stand with feedback alone; no unit."""
        return sum(one and not other for one, other in zip(self.with_share, self.without))

    @property
    def only_without(self) -> int:
        """Robots that stand without it alone; no unit."""
        return sum(other and not one for one, other in zip(self.with_share, self.without))


def trial(
    robot: Robot, generator: Generator, robot_files: Sequence[Path], seeds: Sequence[int], kind: str, slope_deg: float, push_ns: float, seconds: float
) -> Trial:
    """The runs of some robots with two robot files, without feedback and with it, for a time, s."""
    stands: List[List[bool]] = []
    limited: List[float] = []
    for file in robot_files:
        stands.append([])
        limited.clear()
        for seed in seeds:
            varied = variation(seed, kind)
            body = Body(robot, "free", variation=replace(varied, slope_deg=varied.slope_deg + slope_deg), robot_file=file)
            driver = LoopDriver(generator, robot=file, sensors=KNEES)
            trace = run(body, driver, seconds, seed=seed, sensors=KNEES, until=fallen, push_ns=push_ns)
            stands[-1].append(not fallen(body))
            limited.append(driver.limited_share)
            if driver.stopped is not None and stands[-1][-1]:
                raise FootfallError(f"the outputs went off at {trace.time_s[-1]:.2f} s or before, seed {seed}: {driver.stopped}")
    return Trial(stands[0], stands[1], sum(limited) / max(len(limited), 1))


def wilson(count: int, of: int) -> Tuple[float, float]:
    """The 95 % interval of a share, no unit, of ``count`` in ``of`` (E. B. Wilson, J. Am. Stat. Assoc. 22 (1927) 209)."""
    z = 1.959964
    share, square = count / of, z * z / of
    middle, half = (share + square / 2.0) / (1.0 + square), z * math.sqrt(share * (1.0 - share) / of + square / (4.0 * of)) / (1.0 + square)
    return max(0.0, middle - half), min(1.0, middle + half)


def mcnemar(one: int, other: int) -> float:
    """The exact two-sided p of McNemar's test, no unit, for the numbers of pairs that differ to the one side and to the other."""
    pairs = one + other
    tail = sum(math.comb(pairs, count) for count in range(min(one, other) + 1))
    return float(min(1.0, 2.0 * tail / 2.0**pairs))


def table(found: Dict[str, Trial], share: float) -> List[str]:
    """The trials as a table in Markdown; no unit."""
    head = ["trial", "stand without", f"stand with feedback {share:g} at both knees", "with alone, without alone", "p", "gate limits with it, % of the time"]
    lines = [f"| {' | '.join(head)} |", "| --- " * len(head) + "|"]

    def cell(stands: Sequence[bool]) -> str:
        low, high = wilson(sum(stands), len(stands))
        return f"{sum(stands)} of {len(stands)} ({100.0 * low:.0f} to {100.0 * high:.0f} %)"

    for name, one in found.items():
        p = mcnemar(one.only_with, one.only_without)
        difference = f"{one.only_with}, {one.only_without}"
        lines.append(f"| {name} | {cell(one.without)} | {cell(one.with_share)} | {difference} | {p:.2g} | {100.0 * one.limited_share:.1f} |")
    return lines


def trials(
    robot: Robot, generator: Generator, robot_file: Path, share: float, seeds: Sequence[int], kind: str, seconds: float, *, progress: bool
) -> Dict[str, Trial]:
    """Every trial with a share at both knees, no unit, and without, for a time, s; those that have ended, if the keyboard stops them after the first one."""
    with open(robot_file, encoding="utf-8") as file:
        text = file.read()
    found: Dict[str, Trial] = {}
    with tempfile.TemporaryDirectory() as folder:
        files = [os.path.join(folder, name) for name in ("without.toml", "with.toml")]
        for path, one in zip(files, (0.0, share)):
            with open(path, "w", encoding="utf-8") as file:
                file.write(with_share(text, one))
        try:
            for name, (slope_deg, push_ns) in TRIALS.items():
                found[name] = trial(robot, generator, files, seeds, kind, slope_deg, push_ns, seconds)
                if progress:
                    print(table({name: found[name]}, share)[-1], file=sys.stderr, flush=True)
        except KeyboardInterrupt:
            if not found:
                raise
    return found

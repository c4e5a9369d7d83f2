"""The command `search` of ``python -m footfall.body``: the searches with their files, and what is printed of them."""

import argparse
import os
from typing import Dict, List, Tuple

from .. import Certificate, Generator, certify
from .by_name import named_generator
from .gait import Gait
from .outputs import write
from .plane import Plane
from .plane import search as search_plane
from .search import Task, search

#: Options of `search`: what, value without it, least, most.
NUMBERS: Dict[str, Tuple[str, int, int, int]] = {
    "generations": ("generations", 100, 1, 100_000),
    "candidates": ("candidates of a generation", 12, 4, 1000),
    "random": ("seed of the search itself", 1, 1, 1_000_000),
    "jobs": ("processes", os.cpu_count() or 1, 1, 1024),
}


def searched(options: argparse.Namespace) -> Tuple[str, bool]:
    """Searches and writes the files; the text to print, and whether the gait may be used."""
    values = {name: value if getattr(options, name) is None else getattr(options, name) for name, (_, value, _, _) in NUMBERS.items()}
    seeds, step = options.seeds or 2, options.step or 1.0
    return (_plane if options.rig == "free" else _held)(options, values, seeds, step)


def _how(values: Dict[str, int], done: int, seeds: int, step: float) -> str:
    """The last words of a file's settings."""
    generations = f"{values['generations']} generations" if done == values["generations"] else f"stopped after {done} of {values['generations']} generations"
    return f"{generations} of {values['candidates']} candidates on {seeds} robots, step {step:g}, random {values['random']}"


def _ended(values: Dict[str, int], done: int, was_stopped: bool) -> List[str]:
    if not was_stopped:
        return []
    return [f"stopped by the keyboard after {done} of {values['generations']} generations: the best candidate of the last one, not compared on other robots"]


def _certified(written: str, certificate: Certificate) -> List[str]:
    walks = "walks" if certificate.walks else f"does not walk: {certificate.walks_why_not}"
    return [f"wrote {written}: {certificate.status}, {walks}", *(f"  {reason.because}" for reason in certificate.reasons)]


def _held(options: argparse.Namespace, values: Dict[str, int], seeds: int, step: float) -> Tuple[str, bool]:
    task = Task(options.robot, options.rig, options.kind, options.secs, options.robot_file, options.servo, options.supply)
    start = Gait.of(named_generator(options.gait))
    found = search(task, start, seeds=seeds, step=step, progress=not options.quiet, **values)
    settings = (
        f"robot {options.robot}, rig {options.rig}, {options.kind} seeds, {options.secs:g} s, from {options.gait or 'the default walk'}: "
        f"{_how(values, found.generations, seeds, step)}"
    )
    text = found.gait.text(settings)
    write({options.output: text})
    certificate = certify(Generator.parse(text), robot=options.robot_file)
    lines = _ended(values, found.generations, found.was_stopped)
    lines.append(f"{found.runs} runs of {options.secs:g} s, cost {found.cost:.3f} (minus the speed in m/s, plus torque, slip, falls); simulation")
    lines += _certified(options.output, certificate)
    lines.append(f"try it on other robots: python -m footfall.body --rig {options.rig} --gait {options.output} --seeds 20")
    return "\n".join(lines), certificate.status == "accepted" and bool(certificate.walks) and not found.was_stopped


def _plane(options: argparse.Namespace, values: Dict[str, int], seeds: int, step: float) -> Tuple[str, bool]:
    """The same free in the plane, where the park pose is searched too."""
    with open(options.robot_file, encoding="utf-8") as file:
        robot_text = file.read()
    hold_nm = 6.0 if options.hold is None else options.hold
    plane = Plane(
        options.robot, options.kind, options.secs, robot_text, abs(options.push), abs(options.slope), hold_nm, options.servo, options.supply
    )
    start = Gait.of(named_generator(options.gait))
    found = search_plane(plane, start, seeds=seeds, step=step, progress=not options.quiet, **values)
    settings = (
        f"robot {options.robot}, rig free, {options.kind} seeds, {options.secs:g} s, pushes to {abs(options.push):g} N s, slopes to "
        f"{abs(options.slope):g} deg, spring {hold_nm:g} N m, from {options.gait or 'the default walk'} and {options.robot_file}: "
        f"{_how(values, found.generations, seeds, step)}"
    )
    text = found.gait.text(settings)
    write({options.output: text, options.robot_output: found.robot_text})
    certificate = certify(Generator.parse(text), robot=options.robot_output)
    result = f"cost {found.cost:.3f} (minus the speed in m/s, plus falls), {found.falls} of {found.compared} fall; simulation"
    lines = [*_ended(values, found.generations, found.was_stopped), f"{found.runs} runs of {options.secs:g} s, {result}"]
    files = f"--gait {options.output} --robot-file {options.robot_output}"
    if found.hold_nm:
        lines.append(f"a spring of {found.hold_nm:.2f} N m still holds the lean: it does not walk free yet; go on with {files} --hold {found.hold_nm:.2f}")
    lines += _certified(f"{options.output} and {options.robot_output}", certificate)
    lines.append(f"try it on other robots: python -m footfall.body --rig free {files} --seeds 20")
    may_be_used = certificate.status == "accepted" and bool(certificate.walks) and not found.hold_nm and not found.was_stopped
    return "\n".join(lines), may_be_used

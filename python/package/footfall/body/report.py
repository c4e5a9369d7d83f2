"""What the body does, for docs/body.md, by one command, ``python -m footfall.body report``: the runs in a list, and the tables of the page."""

import argparse
import json
import os
import platform
import re
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Callable, Dict, List, Sequence, Tuple

import numpy as np

from .. import Servo
from .._errors import FootfallError, InputError
from . import size
from ._extra import MUJOCO
from .by_name import named_generator
from .drivers import LoopDriver
from .measures import fallen, hashes, measures, together
from .model import STEP_S
from .outputs import check_writable, show, write
from .processes import Processes
from .robots import named
from .rollouts import Ride, outcomes
from .seeds import variation
from .simulation import Body, Trace, run

_EXAMPLES = """examples:
  python -m footfall.body report --short
  python -m footfall.body report --launches
  python -m footfall.body report --only desk-boom --json
  python -m footfall.body report --write docs/body.md

It runs in a clone, whose gaits it reads. All numbers are simulation."""


@dataclass(frozen=True)
class Row:
    """Runs that stand in one line of the page: ``python -m footfall.body`` with these options."""

    options: str
    """As on the command line; no unit."""
    seeds: int = 20
    """Seeds 1 to N; no unit."""

    @property
    def given(self) -> argparse.Namespace:
        """The options one by one."""
        parser = argparse.ArgumentParser()
        parser.add_argument("--rig", default="boom")
        parser.add_argument("--robot", default="desk")
        parser.add_argument("--gait")
        parser.add_argument("--kind", default="standard")
        parser.add_argument("--robot-file")
        parser.add_argument("--slope", type=float, default=0.0)
        parser.add_argument("--push", type=float, default=0.0)
        return parser.parse_args(self.options.split())


_FREE = "--rig free --gait python/walks/desk-free.toml --robot-file python/walks/desk-free-robot.toml"
#: The lines of the page. A new gait is one more.
ROWS: Tuple[Row, ...] = (
    Row("--rig boom"),
    Row("--rig boom --gait natural-walk"),
    Row("--rig boom --gait samples/generator.toml"),
    Row("--rig boom --gait python/walks/desk-boom.toml"),
    Row("--rig boom --gait python/walks/desk-boom.toml --kind wide", 10),
    Row("--rig boom --gait python/walks/desk-boom.toml --slope 1", 1),
    Row("--rig boom --gait python/walks/desk-boom.toml --slope -1", 1),
    Row("--rig boom --robot mini"),
    Row("--rig hung", 1),
    Row("--rig free"),
    Row("--rig free --gait python/walks/desk-boom.toml"),
    Row(_FREE),
    Row(f"{_FREE} --kind wide"),
    Row(f"{_FREE} --push 0.15"),
    Row(f"{_FREE} --push -0.15"),
    Row(f"{_FREE} --slope 1"),
    Row(f"{_FREE} --slope -1"),
)
#: Runs with half of the time step too.
HALVED = ("--rig boom --gait natural-walk", "--rig boom --gait python/walks/desk-boom.toml", _FREE)
#: Length of every run, s.
SECS = 10.0
#: Between these lines of the page stands what this program writes.
_MARKS = ("<!-- Numbers of the body, written by `python -m footfall.body report` -->", "<!-- End of the numbers of the body -->")
#: Digits of a SHA-256 on the page.
_DIGITS = 12


def one_run(row: Row, seed: int, step_s: float = STEP_S) -> Dict[str, Any]:
    """The numbers of one run, with the SHA-256 of its pulses and of the trunk's path (little endian, 64 bits); names have the units."""
    given = row.given
    varied = variation(seed, given.kind)
    varied = replace(varied, slope_deg=varied.slope_deg + given.slope)
    body = Body(named(given.robot), given.rig, variation=varied, robot_file=given.robot_file, step_s=step_s)
    driver = LoopDriver(None if given.gait is None else named_generator(given.gait), robot=given.robot_file)
    trace = run(body, driver, SECS, seed=seed, until=fallen, push_ns=given.push)
    if driver.stopped is not None:
        raise FootfallError(f"{row.options}, seed {seed}: the outputs went off: {driver.stopped}")
    found = measures(trace, fallen(body))
    found.update(seed=seed, limited_share=driver.limited_share, **hashes(trace))
    found["stall_share"] = max(found["motor_rms_nm"]) / body.servos[0].servo.stall_nm
    return found


def _job(job: Tuple[Row, int, float]) -> Dict[str, Any]:
    return one_run(*job)


def _sizes() -> Dict[str, Any]:
    """Torque and speed of each joint: the nominal desk robot on the boom, and a person's legs."""
    body, driver = Body(named("desk"), "boom"), LoopDriver()
    trace: Trace = run(body, driver, SECS, until=fallen)
    rows, classes = size.by_inverse_dynamics(named("person"), named_generator(None), SECS)
    return {"desk": size.of_traces([trace]), "person": rows, "person_servos": classes}


def numbers(rows: Sequence[Row], *, short: bool = False, jobs: int = 1, say: Callable[[str], None] = lambda _: None) -> Dict[str, Any]:
    """The numbers of some lines; ``short``: the nominal robot alone."""
    halved = [row for row in rows if row.options in HALVED]
    # The nominal robot is the same for every kind of seeds.
    nominal = [row for row in rows if row.given.kind == "standard"]
    wanted: List[Tuple[Row, int, float]] = [(row, 0, STEP_S) for row in nominal] + [(row, 0, STEP_S / 2.0) for row in halved]
    if not short:
        wanted += [(row, seed, STEP_S) for row in rows for seed in range(1, row.seeds + 1)]
    found: Dict[Tuple[str, int, float], Dict[str, Any]] = {}

    def collect(results: Any) -> None:
        for number, (job, result) in enumerate(zip(wanted, results), 1):
            found[(job[0].options, job[1], job[2])] = result
            say(f"run {number} of {len(wanted)}: {job[0].options}, seed {job[1]}, {result['metres']:.3f} m in {result['seconds']:.1f} s")

    if jobs == 1:
        collect(map(_job, wanted))
    else:
        with Processes(jobs) as pool:
            collect(pool.each(_job, wanted))
    lines: List[Dict[str, Any]] = []
    for row in rows:
        line: Dict[str, Any] = {"options": row.options}
        if row in nominal:
            line["nominal"] = found[(row.options, 0, STEP_S)]
        if row in halved:
            line["halved"] = found[(row.options, 0, STEP_S / 2.0)]
        if not short:
            each = [found[(row.options, seed, STEP_S)] for seed in range(1, row.seeds + 1)]
            line.update(all=together(each), each=each)
            line["all"].update(slip_m_mean=float(np.mean([one["slip_m"] for one in each])), slip_m_most=max(one["slip_m"] for one in each))
            line["all"].update(stall_share_most=max(one["stall_share"] for one in each), stall_share=_stall_share(row, line["all"]))
        lines.append(line)
    return {"simulation": True, "mujoco": MUJOCO, "numpy": np.__version__, "machine": platform.machine(), "rows": lines, "sizes": _sizes()}


#: Launches of the walk in the plane: phases an equal part of a stride apart, the first that of all other runs; seeds 1 to N; time, s.
LAUNCH_PHASES, LAUNCH_SEEDS, LAUNCH_SECS = 8, 6, 6.0


def launches() -> List[Dict[str, Any]]:
    """Quick runs of the walk in the plane with the button held later, by parts of a stride; ``later_s`` in s, ``falls`` of ``runs``: no unit."""
    given = Row(_FREE).given
    generator = named_generator(given.gait)
    bodies = [Body(named(given.robot), given.rig, variation=variation(seed), robot_file=given.robot_file) for seed in range(1, LAUNCH_SEEDS + 1)]
    found = []
    for phase in range(LAUNCH_PHASES):
        later_ms = round(1000.0 * generator.stride_s * phase / LAUNCH_PHASES)
        pulses = LoopDriver.pulses(generator, LAUNCH_SECS, robot=given.robot_file, later_ms=later_ms)
        each = outcomes([Ride(body, pulses.frames) for body in bodies], LAUNCH_SECS)
        found.append({"later_s": later_ms / 1000.0, "runs": len(each), "falls": sum(one.fallen for one in each)})
    return found


def _launch_lines(found: Sequence[Dict[str, Any]]) -> List[str]:
    """The launches as lines of text; s."""
    falls, runs = (sum(one[name] for one in found) for name in ("falls", "runs"))
    rows = [[f"{one['later_s']:.3f}", f"{one['falls']} of {one['runs']}"] for one in found]
    head = f"{_FREE}, standard seeds 1 to {LAUNCH_SEEDS}, {LAUNCH_SECS:g} s, quick runs: {falls} of {runs} launches fall; simulation"
    return [head, "", *_table(["button held later by s", "falls"], rows)]


def _stall_share(row: Row, all_runs: Dict[str, Any]) -> float:
    """Motor torque (root mean square, the joint with the largest) to the stall torque of all runs together; no unit."""
    robot = named(row.given.robot)
    return float(max(all_runs["motor_rms_nm"])) / Servo(robot.servo, supply_v=robot.supply_v).stall_nm


def _pair(first: Sequence[float], second: Sequence[float]) -> str:
    return f"{max(first):.2f}, {max(second):.2f}"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> List[str]:
    return ["| " + " | ".join(cells) + " |" for cells in (head, ["---"] * len(head), *rows)]


def text(found: Dict[str, Any]) -> List[str]:
    """The tables in Markdown, as they stand on the page; m, N m, deg and deg/s."""
    lines: List[str] = []
    if all("all" in line for line in found["rows"]):
        head = ["options", "way m (range)", "falls", "steps", "slip, m a metre", "slip m, mean, most", "output torque peak, rms N m", "motor torque peak, rms N m"]
        head += ["motor rms of stall, all, worst", "peak speed deg/s", "error of hips, knees deg rms"]
        rows = []
        for line in found["rows"]:
            one, count = line["all"], len(line["each"])
            slip = "-" if one["slip_share_mean"] is None else f"{one['slip_share_mean']:.3f}"
            error = one["tracking_rms_deg"]
            cells = [f"`{line['options']}`", f"{one['metres_mean']:.2f} ({one['metres_least']:.2f} to {one['metres_most']:.2f})", f"{one['falls']} of {count}"]
            cells += [f"{one['steps_mean']:.1f}", slip, f"{one['slip_m_mean']:.3f}, {one['slip_m_most']:.3f}", _pair(one["output_peak_nm"], one["output_rms_nm"])]
            cells += [_pair(one["motor_peak_nm"], one["motor_rms_nm"]), f"{one['stall_share']:.3f}, {one['stall_share_most']:.3f}"]
            cells += [f"{max(one['speed_peak_deg_s']):.0f}", f"{max(error[:2]):.1f}, {max(error[2:]):.1f}"]
            rows.append(cells)
        lines += [*_table(head, rows), "", "The nominal robot, with the first digits of the SHA-256 of its pulses and of the path of its trunk:", ""]
    rows = []
    for line in [one for one in found["rows"] if "nominal" in one]:
        one, half = line["nominal"], line.get("halved")
        change = ""
        if half is not None:
            change = f"{half['metres']:.3f} ({100.0 * (half['metres'] / one['metres'] - 1.0):+.2f} %), slip {half['slip_m']:.3f} for {one['slip_m']:.3f}"
        end = "fallen" if one["fallen"] else "up"
        rows.append([f"`{line['options']}`", f"{one['metres']:.3f}", f"{one['seconds']:.2f}, {end}", change, one["pulses_sha256"][:_DIGITS], one["path_sha256"][:_DIGITS]])
    lines += _table(["options of the nominal robot", "way m", "until s", "way m with half of the time step, slip m", "pulses", "path"], rows)
    lines += ["", "`size` (desk robot on the boom, nominal) and `size --robot person`:", ""]
    rows = []
    for robot in ("desk", "person"):
        for one in found["sizes"][robot]:
            torque = f"{one['torque_95_nm']:.2f}, {one['torque_100_nm']:.2f}"
            speed = f"{one['speed_95_deg_s']:.0f}, {one['speed_100_deg_s']:.0f}"
            rows.append([f"{robot}, {one['joint'].replace('_', ' ')}", torque, speed])
    lines += _table(["", "torque 95 %, 100 % N m", "speed 95 %, 100 % deg/s"], rows)
    versions = f"MuJoCo {found['mujoco']}, numpy {found['numpy']}, {found['machine']}"
    return [*lines, "", f"Measured with {versions}. Another kind of processor may give other bits, and so other digits of the path."]


def on_page(page: str) -> Dict[str, Tuple[float, str, str]]:
    """Of a page's text: for each line of the nominal robot, its way (m) and the digits of pulses and path."""
    found = {}
    for cells in (line.strip("| \n").split(" | ") for line in page.splitlines()):
        if len(cells) == 6 and re.fullmatch(rf"[0-9a-f]{{{_DIGITS}}}", cells[5]):
            found[cells[0].strip("`")] = (float(cells[1]), cells[4], cells[5])
    return found


def _with_files(rows: Sequence[Row]) -> None:
    """Refuses lines whose gaits or robot files are not there, before the runs of the others."""
    for row in rows:
        for path in (row.given.gait, row.given.robot_file):
            if path is not None and path.endswith(".toml") and not os.path.isfile(path):
                raise InputError(f"{path}: no such file; `report` reads the gaits of the repository: run it in the folder of a clone that has README.md")


def _write(path: str, lines: Sequence[str]) -> None:
    page = Path(path).read_text(encoding="utf-8")
    before, first, rest = page.partition(_MARKS[0])
    _, last, after = rest.partition(_MARKS[1])
    if not first or not last:
        raise InputError(f"{path}: no lines '{_MARKS[0]}' and '{_MARKS[1]}', between which the numbers stand")
    whole = "\n".join([before + first, "", *lines, "", last + after])
    write({path: whole})


def main(arguments: Sequence[str]) -> int:
    """Runs the command line and returns its exit code: 0 for a run, 1 for a run that failed, 2 for wrong input; no unit."""
    parser = argparse.ArgumentParser(
        prog="python -m footfall.body report",
        description="Prints the tables of docs/body.md that say what the body does, with a SHA-256 of the pulses and of the trunk's path of each line. Two runs are equal.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("--short", action="store_true", help="the nominal robot alone, instead of all seeds")
    parser.add_argument("--launches", action="store_true", help="instead of the tables: launches of the walk in the plane at other phases of its stride")
    parser.add_argument("--only", metavar="TEXT", help="only lines whose options contain this")
    parser.add_argument("--write", metavar="PAGE", help="write the tables between their marks on this page")
    parser.add_argument("--jobs", metavar="N", type=int, default=os.cpu_count() or 1, help="processes")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--quiet", action="store_true", help="no progress")
    options = parser.parse_args(arguments)
    try:
        if options.jobs < 1:
            raise InputError(f"--jobs {options.jobs}: allowed is 1 or more")
        if options.write and (options.short or options.only):
            raise InputError("--write: the page has every number; allowed without --short and --only")
        if options.launches:
            if options.short or options.only or options.write:
                raise InputError("--launches: it has no tables of the page; allowed without --short, --only and --write")
            _with_files([Row(_FREE)])
            found_launches = launches()
            show(json.dumps({"simulation": True, "launches": found_launches}) if options.json else "\n".join(_launch_lines(found_launches)))
            return 0
        rows = [row for row in ROWS if options.only is None or options.only in row.options]
        if not rows:
            raise InputError(f"--only '{options.only}': no line has this in its options; they are {'; '.join(row.options for row in ROWS)}")
        _with_files(rows)
        if options.write:
            check_writable("--write", options.write)
        say = (lambda _: None) if options.quiet else (lambda line: print(line, file=sys.stderr, flush=True))
        found = numbers(rows, short=options.short, jobs=options.jobs, say=say)
        lines = text(found)
        if options.write:
            _write(options.write, lines)
        show(json.dumps(found) if options.json else "\n".join(lines))
    except (InputError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except (FootfallError, ImportError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("error: stopped by the keyboard", file=sys.stderr)
        return 1
    return 0

"""The command line ``python -m footfall.body``: exit code 0 for a run, 1 for a run that failed or a file that cannot be written, 2 for wrong input."""

import argparse
import json
import sys
from typing import Any, Dict, List, Optional, Sequence, Tuple

from .. import JOINTS, Servo, servos
from .._errors import FootfallError, InputError
from . import board_feedback, body_file, feedback, options as command_line, picture, report, size, wearer_cli
from .by_name import named_generator, named_robot
from .measures import together
from .outputs import show
from .runs import Runs, runs_of, settings, title, why_it_does_not_walk
from .search_cli import searched


def _error(text: str) -> None:
    print(f"error: {text}", file=sys.stderr)


def _table(all_runs: Dict[str, Any]) -> List[str]:
    lines = [f"{all_runs['runs']} runs, {all_runs['falls']} falls; simulation, not shown on a robot"]
    slip = all_runs["slip_share_mean"]
    lines.append(
        f"{all_runs['metres_mean']:.2f} m ({all_runs['metres_least']:.2f} to {all_runs['metres_most']:.2f}), {all_runs['steps_mean']:.1f} steps, "
        + (f"slip {slip:.3f} m a metre" if slip is not None else "no way, so no slip")
    )
    limited = all_runs["limited_share_mean"]
    lines.append("limits of the gate: not measured with --elf" if limited is None else f"the gate limits {100.0 * limited:.1f} % of the control periods")
    lines.append(f"{'':12}{'output N m':>18}{'motor N m':>18}{'speed':>10}{'error':>10}")
    lines.append(f"{'':12}{'peak':>9}{'rms':>9}{'peak':>9}{'rms':>9}{'deg/s':>10}{'deg rms':>10}")
    for place, joint in enumerate(JOINTS):
        torques = [all_runs[name][place] for name in ("output_peak_nm", "output_rms_nm", "motor_peak_nm", "motor_rms_nm")]
        cells = "".join(f"{torque:9.3f}" for torque in torques)
        lines.append(f"{joint:12}{cells}{all_runs['speed_peak_deg_s'][place]:10.0f}{all_runs['tracking_rms_deg'][place]:10.2f}")
    return lines


def _walk(options: argparse.Namespace) -> int:
    """Prints the numbers of the runs, and then writes the picture; returns the exit code, no unit."""
    runs = runs_of(options)
    found = together(runs.each)
    why_not = why_it_does_not_walk(options, runs)
    try:
        if options.json:
            whole = {"simulation": True, **settings(options), "walks_why_not": why_not, "stopped": runs.stopped, "all": found, "each": runs.each}
            show(json.dumps(whole))
        else:
            show("\n".join(_table(found)))
    finally:
        if options.picture is not None:
            picture.draw(runs.traces[0], options.picture, title(options, runs.each[0]["seed"]))
    if runs.stopped:
        _error(runs.stopped)
    return 1 if runs.stopped else 0


def _kept(ended: int, asked: int, what: str) -> Optional[str]:
    """What is said where the keyboard stopped a command that shows the results that it has; ``None`` if it has all. ``what`` they are of. No unit."""
    return None if ended == asked else f"stopped by the keyboard: {ended} of {asked} {what} have ended"


def _sized(options: argparse.Namespace, gait: Optional[str], speed: float) -> Dict[str, Any]:
    """Torques (N m), speeds (deg/s) and servos of one gait at one speed."""
    robot = named_robot(options.robot)
    one = argparse.Namespace(**{**vars(options), "gait": gait, "speed": speed})
    why_not, limited_share = None, None
    if robot.servo or options.servo:
        runs = _all_of(one)
        why_not, limited_share = why_it_does_not_walk(one, runs), together(runs.each)["limited_share_mean"]
        rows = size.of_traces(runs.traces)
        choice = [] if options.elf else [_with_servo(one, name, why_not) for name in servos()]
    else:
        rows, choice = size.by_inverse_dynamics(robot, named_generator(gait, speed), options.secs)
    line = {"gait": gait or "default walk", "speed": speed, "joints": rows, "servos": choice}
    return {**line, "limited_share": limited_share, "walks_why_not": why_not}


def _size(options: argparse.Namespace, gaits: Sequence[Optional[str]], speeds: Sequence[float]) -> Optional[str]:
    """Prints the tables of all gaits and speeds, or of those that have ended when the keyboard stops it: then it returns that. No unit."""
    asked, found = [(gait, speed) for gait in gaits for speed in speeds], []
    try:
        for gait, speed in asked:
            found.append(_sized(options, gait, speed))
    except KeyboardInterrupt:
        if not found:
            raise
    stopped = _kept(len(found), len(asked), "gaits and speeds")
    by_servos = bool(named_robot(options.robot).servo or options.servo)
    how = f"rig {options.rig}, with servos" if by_servos else "legs that hang and move along the gait, without servos"
    if options.json:
        what = {name: value for name, value in settings(options).items() if name not in ("gait", "speed")}
        show(json.dumps({"simulation": True, **what, "how": how, "stopped": stopped, "runs": found}))
        return stopped
    body = options.robot + (f" with {options.robot_file}" if options.robot_file else "")
    show("\n".join([f"{body}, {how}; enough for 95 and for 100 % of the time; simulation", *size.table(found)]))
    return stopped


def _all_of(options: argparse.Namespace) -> Runs:
    """The runs of all seeds, or none."""
    runs = runs_of(options)
    if runs.stopped:
        raise KeyboardInterrupt
    return runs


def _with_servo(options: argparse.Namespace, servo: str, why_not: Optional[str]) -> Dict[str, Any]:
    """How the same body walks with another class of servos, at its highest supply: its masses stay. ``why_not``: why the gate lets no servo walk."""
    supply_v = Servo(servo, supply_v=0.0).supply_range_v[1]
    one = argparse.Namespace(**{**vars(options), "servo": servo, "supply": supply_v, "quiet": True})
    runs = _all_of(one)
    found = size.suffices(Servo(servo, supply_v=supply_v), runs.traces, together(runs.each))
    return {**found, "suffices": found["suffices"] and why_not is None}


def _what(options: argparse.Namespace) -> Dict[str, Any]:
    """What `feedback` was run on; s."""
    return {name: getattr(options, name) for name in ("robot", "robot_file", "gait", "secs")}


def _feedback(options: argparse.Namespace) -> Optional[str]:
    """Prints what robots stand with each law, or with those of `--law`, and the differences to none; 50 robots without `--seeds`.

    Where the keyboard stops it, it prints the laws that have ended, and returns that. No unit.
    """
    seeds = range(1, (options.seeds or 50) + 1)
    if options.loop is not None:
        return _feedback_of_loop(options, seeds)
    robot, gait = named_robot(options.robot), feedback.gait_of(named_generator(options.gait), options.robot_file)
    heel = feedback.heel_phase(gait, robot, options.robot_file)
    names = list(dict.fromkeys(["none", *(options.law or feedback.LAWS)]))
    stood: Dict[str, feedback.Limits] = {}
    try:
        for name in names:
            stood[name] = feedback.limits(gait, robot, options.robot_file, feedback.LAWS[name], seeds, options.kind, heel_cycles=heel, seconds=options.secs)
            if not options.quiet:
                lines = feedback.row(name, stood[name]), feedback.gain_row(name, stood[name], stood["none"])
                print(f"law {len(stood)} of {len(names)}, and its differences to none:", *lines, sep="\n", file=sys.stderr, flush=True)
    except KeyboardInterrupt:
        if not stood:
            raise
    stopped = _kept(len(stood), len(names), "laws")
    if options.json:
        laws = [{"law": name, **vars(one), "gain": feedback.gain(one, stood["none"])} for name, one in stood.items()]
        whole = {"robots": len(seeds), "kind": options.kind, "heel_cycles": heel, "stopped": stopped, "laws": laws}
        show(json.dumps({"simulation": True, **_what(options), **whole}))
        return stopped
    head = f"{len(seeds)} robots, {options.kind} seeds, {options.secs:g} s, left heel at {heel:.3f} cycles; simulation, not shown on a robot"
    show("\n".join([head, "", *feedback.tables(stood)]))
    return stopped


def _feedback_of_loop(options: argparse.Namespace, seeds: Sequence[int]) -> Optional[str]:
    """The same with feedback in the control loop of the boards, and without."""
    generator, share = named_generator(options.gait), options.loop
    found = board_feedback.trials(
        named_robot(options.robot), generator, options.robot_file, share, seeds, options.kind, options.secs, progress=not options.quiet
    )
    stopped = _kept(len(found), len(board_feedback.TRIALS), "trials")
    if options.json:
        each = [{"trial": name, **vars(one), "only_with": one.only_with, "only_without": one.only_without} for name, one in found.items()]
        whole = {"robots": len(seeds), "kind": options.kind, "feedback": share, "stopped": stopped, "trials": each}
        show(json.dumps({"simulation": True, **_what(options), **whole}))
        return stopped
    head = f"{len(seeds)} robots, {options.kind} seeds, {options.secs:g} s, the control loop of the boards; simulation, not shown on a robot"
    show("\n".join([head, "", *board_feedback.table(found, share)]))
    return stopped


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Runs the command line and returns its exit code; no unit."""
    given = sys.argv[1:] if arguments is None else list(arguments)
    if given[:1] == ["worn"]:
        return wearer_cli.main(given[1:])
    if given[:1] == ["report"]:
        return report.main(given[1:])
    try:
        options, gaits, speeds = command_line.read(given)
        if options.command in ("feedback", "size"):
            stopped = _feedback(options) if options.command == "feedback" else _size(options, gaits, speeds)
            if stopped:
                _error(stopped)
                return 1
        elif options.command == "defaults":
            show(body_file.text_of(named_robot(options.robot)))
        elif options.command == "search":
            text, may_be_used = searched(options)
            show(text)
            return 0 if may_be_used else 1
        else:
            return _walk(options)
    except (InputError, OSError) as error:
        _error(str(error))
        return 2
    except (FootfallError, ImportError) as error:
        _error(str(error))
        return 1
    except KeyboardInterrupt:
        _error("stopped by the keyboard")
        return 1
    return 0

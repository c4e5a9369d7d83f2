"""The command line ``python -m footfall.body``: exit code 0 for a run, 1 for a run that failed, 2 for wrong input."""

import argparse
import json
import math
import os
import sys
from dataclasses import replace
from typing import Any, Dict, List, Optional, Sequence, Tuple

from .. import JOINTS, Generator, Servo, certify, servos
from .._errors import FootfallError, InputError
from . import board_feedback, body_file, feedback, picture, report, size, wearer_cli
from .board import BoardDriver
from .by_name import named_generator, named_robot
from .drivers import LoopDriver
from .gait import Gait
from .measures import fallen, hashes, measures, together
from .model import RIGS
from .plane import Plane
from .plane import search as search_plane
from .search import Task, search
from .seeds import KINDS, variation
from .sensor import DEFAULT_SENSORS, sensors_of
from .simulation import PUSH_AT_S, Body, Trace, run

_EXAMPLES = """examples:
  python -m footfall.body --rig boom --secs 10
  python -m footfall.body --rig boom --seeds 20 --json
  python -m footfall.body --rig hung --robot mini --gait samples/generator.toml
  python -m footfall.body --rig free --secs 3 --picture fall.png
  python -m footfall.body size --gait samples/generator.toml
  python -m footfall.body size --robot person
  python -m footfall.body defaults > body.toml
  python -m footfall.body size --body body.toml
  python -m footfall.body size --gait natural-walk --gait human-walk --speed 0.8,1,1.2
  python -m footfall.body worn --help
  python -m footfall.body report --help
  python -m footfall.body search --rig boom --gait natural-walk --secs 6 --generations 100 -o walk.toml
  python -m footfall.body feedback --gait python/walks/desk-free.toml --robot-file python/walks/desk-free-robot.toml
  python -m footfall.body feedback --loop 0.3 --gait python/walks/desk-free.toml --robot-file python/walks/desk-free-robot.toml

All numbers are simulation; docs/body.md says what each rig is honest for."""


def _number(least: float, most: float, unit: str) -> Any:
    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"'{text}': allowed is {least:g} to {most:g}{unit}")
        return value

    return read


def _speeds(text: str) -> List[float]:
    # The range of the board's own setting.
    return [_number(0.5, 1.5, "")(one) for one in text.split(",")]


def _whole(least: int, most: int) -> Any:
    def read(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = least - 1
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"'{text}': allowed is a whole number from {least} to {most}")
        return value

    return read


#: Options of `search`: what, value without it, least, most.
_SEARCH: Dict[str, Tuple[str, int, int, int]] = {
    "generations": ("generations", 100, 1, 100_000),
    "candidates": ("candidates of a generation", 12, 4, 1000),
    "random": ("seed of the search itself", 1, 1, 1_000_000),
    "jobs": ("processes", os.cpu_count() or 1, 1, 1024),
}


_COMMANDS = (
    "walk (if it is not given), size, search, feedback: pushes and slopes that robots withstand free in the plane, with and without feedback, or "
    "defaults: prints the body file of --robot; worn and report have options of their own"
)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m footfall.body",
        description="Runs a simulated biped whose servos the control loop of the boards drives. `size` says how strong and fast servos have to be, "
        "`search` finds a gait, `feedback` tries laws that change it.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("command", nargs="?", choices=("walk", "size", "search", "feedback", "defaults"), default="walk", help=_COMMANDS)
    parser.add_argument("--law", action="append", choices=tuple(feedback.LAWS), help="feedback: a law to try; may be given several times (all of them)")
    parser.add_argument(
        "--loop",
        metavar="SHARE",
        type=_number(-0.8, 0.8, ", the share of both knees"),
        help="feedback: instead of the laws, the control loop of the boards with this feedback at both knees in the robot file, and without",
    )
    parser.add_argument("--rig", choices=RIGS, help="hung in the air, on a boom that holds the lean (default), or free in the plane (always with feedback)")
    parser.add_argument(
        "--robot",
        default="desk",
        metavar="NAME|FILE",
        help="a body: desk, 1.2 kg (the default); mini, 0.3 kg; person, 70 kg, size only. A name that ends with .toml is a robot file, as with --robot-file",
    )
    parser.add_argument("--body", metavar="FILE", help="a body of your own: a file of masses and lengths, as `defaults` prints one")
    parser.add_argument(
        "--gait",
        metavar="FILE|NAME",
        action="append",
        help="generator file, as `footfall fit` writes it, or a gait's name; without it, the default walk; with size it may be given several times",
    )
    parser.add_argument("--speed", metavar="X,...", type=_speeds, help="factor on the speed of the gait, 0.5 to 1.5 (1); with size several, such as 0.8,1,1.2")
    parser.add_argument("--elf", metavar="ELF", help="an image on the virtual board; without it, the control loop in this process")
    parser.add_argument("--robot-record", metavar="FILE", help="robot record of the image, as `footfall pack --robot` writes it")
    parser.add_argument("--generator-record", metavar="FILE", help="generator record of the image; without it, its default walk")
    parser.add_argument(
        "--sensor-record",
        metavar="FILE",
        help="sensor record of the image: the joints of --robot-file that have feedback, left before right and hips before knees, with `footfall defaults sensor`",
    )
    parser.add_argument("--exchange", metavar="MS", type=_whole(1, 20), help="how far the image goes at once, ms (1): a larger number is faster")
    parser.add_argument("--robot-file", metavar="FILE", help="robot file with servo map and limits of the body; the default robot without it")
    parser.add_argument("--servo", choices=servos(), help="servo of all joints; that of the robot without it")
    parser.add_argument("--supply", metavar="V", type=_number(0.0, 30.0, " V"), help="supply of the servos, V; that of the robot without it")
    parser.add_argument("--secs", metavar="S", type=_number(1.0, 600.0, " s"), default=10.0, help="from the first servo pulse on, s (10)")
    parser.add_argument("--seeds", metavar="N", type=_whole(1, 10_000), help="N runs with varied robots, seeds 1 to N; one nominal robot without it")
    parser.add_argument("--kind", choices=KINDS, default="standard", help="how much the seeds vary")
    of_search = parser.add_argument_group("search", "CMA-ES; each generation tries its candidates on --seeds new robots (2)")
    of_search.add_argument("-o", "--output", metavar="FILE", help="generator file that it writes")
    for option, (what, value, least, most) in _SEARCH.items():
        of_search.add_argument(f"--{option}", metavar="N", type=_whole(least, most), help=f"{what} ({value})")
    of_search.add_argument("--robot-output", metavar="FILE", help="free: robot file that it writes, --robot-file with the park pose of the gait")
    hold = "free: first stiffness of the spring at the lean, N m for 1 rad (6)"
    of_search.add_argument("--hold", metavar="NM", type=_number(0.0, 100.0, " N m"), help=hold)
    of_search.add_argument("--step", metavar="X", type=_number(0.01, 10.0, ""), help="first step, as a factor of 0.08 s and 2 to 4 deg (1)")
    parser.add_argument("--slope", metavar="DEG", type=_number(-10.0, 10.0, " deg"), default=0.0, help="of the floor, upwards, beside that of the seeds")
    parser.add_argument("--push", metavar="NS", type=_number(-10.0, 10.0, " N s"), default=0.0, help="push at the trunk, forwards, for 0.1 s at 5 s")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--picture", metavar="FILE", help="write the first run: .png a strip of stick figures, .gif and .mp4 a video")
    parser.add_argument("--quiet", action="store_true", help="no progress")
    return parser


def _runs(options: argparse.Namespace) -> List[Tuple[Trace, Dict[str, Any]]]:
    """The runs of all seeds."""
    robot, found = named_robot(options.robot), []
    seeds = [0] if options.seeds is None else list(range(1, options.seeds + 1))
    sensors = sensors_of(options.robot_file)
    if options.elf is not None and sensors != DEFAULT_SENSORS and not options.sensor_record:
        names = " ".join(f"--sensor {joint}=sensor.toml" for joint, _ in sensors)
        raise InputError(f"--robot-file: a joint has feedback, so --elf needs --sensor-record; `footfall pack {names} -o sensors.bin` writes it")
    for number, seed in enumerate(seeds, 1):
        varied = variation(seed, options.kind)
        body = Body(
            robot,
            options.rig,
            variation=replace(varied, slope_deg=varied.slope_deg + options.slope),
            servo=options.servo,
            supply_v=options.supply,
            robot_file=options.robot_file,
        )
        if options.elf is None:
            # Without feedback the sensor is that of the joint that the generator follows.
            of_loop = None if sensors == DEFAULT_SENSORS else sensors
            generator = None if options.gait is None else named_generator(options.gait)
            driver = LoopDriver(generator, robot=options.robot_file, sensors=of_loop, speed=options.speed)
            trace = run(body, driver, options.secs, seed=seed, sensors=sensors, until=fallen, push_ns=options.push)
            stopped = driver.stopped
        else:
            records = {"robot": options.robot_record, "generator": options.generator_record, "sensors": options.sensor_record}
            with BoardDriver(options.elf, **records) as board:
                exchange_ms = options.exchange or 1
                trace = run(body, board, options.secs, seed=seed, sensors=sensors, until=fallen, push_ns=options.push, exchange_ms=exchange_ms)
                stopped = board.stopped
        has_fallen = fallen(body)
        if stopped is not None:
            raise FootfallError(f"the outputs went off at {trace.time_s[-1]:.2f} s or before, seed {seed}: {stopped}")
        one = {"seed": seed, **measures(trace, has_fallen), **hashes(trace)}
        # The columns of many long runs would need gigabytes; `size` alone needs them all.
        keep = trace if options.command == "size" or number == 1 else None
        found.append((keep, one))
        if not options.quiet:
            end = "fallen" if has_fallen else "up"
            print(f"run {number} of {len(seeds)}: seed {seed}, {one['metres']:.2f} m in {one['seconds']:.1f} s, {end}", file=sys.stderr, flush=True)
    return found  # type: ignore[return-value]


def _table(all_runs: Dict[str, Any]) -> List[str]:
    lines = [f"{all_runs['runs']} runs, {all_runs['falls']} falls; simulation, not shown on a robot"]
    slip = all_runs["slip_share_mean"]
    lines.append(
        f"{all_runs['metres_mean']:.2f} m ({all_runs['metres_least']:.2f} to {all_runs['metres_most']:.2f}), {all_runs['steps_mean']:.1f} steps, "
        + (f"slip {slip:.3f} m a metre" if slip is not None else "no way, so no slip")
    )
    lines.append(f"{'':12}{'output N m':>18}{'motor N m':>18}{'speed':>10}{'error':>10}")
    lines.append(f"{'':12}{'peak':>9}{'rms':>9}{'peak':>9}{'rms':>9}{'deg/s':>10}{'deg rms':>10}")
    for place, joint in enumerate(JOINTS):
        torques = [all_runs[name][place] for name in ("output_peak_nm", "output_rms_nm", "motor_peak_nm", "motor_rms_nm")]
        cells = "".join(f"{torque:9.3f}" for torque in torques)
        lines.append(f"{joint:12}{cells}{all_runs['speed_peak_deg_s'][place]:10.0f}{all_runs['tracking_rms_deg'][place]:10.2f}")
    return lines


def _walk(options: argparse.Namespace) -> str:
    runs = _runs(options)
    if options.picture is not None:
        title = f"{options.robot} on rig {options.rig}, {options.gait or 'default walk'}, seed {runs[0][1]['seed']}"
        picture.draw(runs[0][0], options.picture, title)
    found = together([one for _, one in runs])
    if options.json:
        return json.dumps({"simulation": True, "rig": options.rig, "robot": options.robot, "all": found, "each": [one for _, one in runs]})
    return "\n".join(_table(found))


def _size(options: argparse.Namespace, asked_gaits: Sequence[Optional[str]], speeds: Sequence[float]) -> str:
    if options.picture is not None:
        raise InputError("--picture: `size` has none; allowed with `walk`")
    robot, found = named_robot(options.robot), []
    for gait in asked_gaits:
        for speed in speeds:
            one = argparse.Namespace(**{**vars(options), "gait": gait, "speed": speed})
            if robot.servo or options.servo:
                rows = size.of_traces([trace for trace, _ in _runs(one)])
                choice = [] if options.elf else [_with_servo(one, name) for name in servos()]
            else:
                rows, choice = size.by_inverse_dynamics(robot, named_generator(gait, speed), options.secs)
            found.append({"gait": gait or "default walk", "speed": speed, "joints": rows, "servos": choice})
    by_servos = bool(robot.servo or options.servo)
    how = f"rig {options.rig}, with servos" if by_servos else "legs that hang and move along the gait, without servos"
    if options.json:
        return json.dumps({"simulation": True, "robot": options.robot, "how": how, "runs": found})
    return "\n".join([f"{options.robot}, {how}; enough for 95 and for 100 % of the time; simulation", *size.table(found)])


def _with_servo(options: argparse.Namespace, servo: str) -> Dict[str, Any]:
    """How the same body walks with another class of servos, at its highest supply: its masses stay."""
    supply_v = Servo(servo, supply_v=0.0).supply_range_v[1]
    one = argparse.Namespace(**{**vars(options), "servo": servo, "supply": supply_v, "quiet": True})
    runs = _runs(one)
    return size.suffices(Servo(servo, supply_v=supply_v), [trace for trace, _ in runs], together([measured for _, measured in runs]))


def _search(options: argparse.Namespace) -> Tuple[str, bool]:
    """The text to print, and whether the gait may be used."""
    values = {name: value if getattr(options, name) is None else getattr(options, name) for name, (_, value, _, _) in _SEARCH.items()}
    seeds, step = options.seeds or 2, options.step or 1.0
    if options.rig == "free":
        return _search_plane(options, values, seeds, step)
    task = Task(options.robot, options.rig, options.kind, options.secs, options.robot_file, options.servo, options.supply)
    start = Gait.of(named_generator(options.gait))
    found = search(task, start, seeds=seeds, step=step, progress=not options.quiet, **values)
    settings = (
        f"robot {options.robot}, rig {options.rig}, {options.kind} seeds, {options.secs:g} s, from {options.gait or 'the default walk'}: "
        f"{values['generations']} generations of {values['candidates']} candidates on {seeds} robots, step {step:g}, random {values['random']}"
    )
    text = found.gait.text(settings)
    certificate = certify(Generator.parse(text), robot=options.robot_file)
    with open(options.output, "w", encoding="utf-8", newline="\n") as file:
        file.write(text)
    lines = [f"{found.runs} runs of {options.secs:g} s, cost {found.cost:.3f} (minus the speed in m/s, plus torque, slip, falls); simulation"]
    lines.append(f"wrote {options.output}: {certificate.status}, " + ("walks" if certificate.walks else f"does not walk: {certificate.walks_why_not}"))
    lines += [f"  {reason.because}" for reason in certificate.reasons]
    lines.append(f"try it on other robots: python -m footfall.body --rig {options.rig} --gait {options.output} --seeds 20")
    return "\n".join(lines), certificate.status == "accepted" and bool(certificate.walks)


def _search_plane(options: argparse.Namespace, values: Dict[str, int], seeds: int, step: float) -> Tuple[str, bool]:
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
        f"{values['generations']} generations of {values['candidates']} candidates on {seeds} robots, step {step:g}, random {values['random']}"
    )
    text = found.gait.text(settings)
    for name, content in ((options.output, text), (options.robot_output, found.robot_text)):
        with open(name, "w", encoding="utf-8", newline="\n") as file:
            file.write(content)
    certificate = certify(Generator.parse(text), robot=options.robot_output)
    result = f"cost {found.cost:.3f} (minus the speed in m/s, plus falls), {found.falls} of {found.compared} fall; simulation"
    lines = [f"{found.runs} runs of {options.secs:g} s, {result}"]
    if found.hold_nm:
        lines.append(
            f"a spring of {found.hold_nm:.2f} N m still holds the lean: it does not walk free yet; go on with --gait {options.output} "
            f"--robot-file {options.robot_output} --hold {found.hold_nm:.2f}"
        )
    walks = "walks" if certificate.walks else f"does not walk: {certificate.walks_why_not}"
    lines.append(f"wrote {options.output} and {options.robot_output}: {certificate.status}, {walks}")
    lines += [f"  {reason.because}" for reason in certificate.reasons]
    files = f"--gait {options.output} --robot-file {options.robot_output}"
    lines.append(f"try it on other robots: python -m footfall.body --rig free {files} --seeds 20")
    return "\n".join(lines), certificate.status == "accepted" and bool(certificate.walks) and not found.hold_nm


def _feedback(options: argparse.Namespace) -> str:
    """The tables of what robots stand with each law, or with those of `--law`, and of the differences to none; 50 robots without `--seeds`."""
    seeds = range(1, (options.seeds or 50) + 1)
    if options.loop is not None:
        return _feedback_of_loop(options, seeds)
    robot, gait = named_robot(options.robot), feedback.gait_of(named_generator(options.gait), options.robot_file)
    heel = feedback.heel_phase(gait, robot, options.robot_file)
    names = ["none", *(name for name in options.law or feedback.LAWS if name != "none")]
    stood: Dict[str, feedback.Limits] = {}
    for name in dict.fromkeys(names):
        stood[name] = feedback.limits(gait, robot, options.robot_file, feedback.LAWS[name], seeds, options.kind, heel_cycles=heel, seconds=options.secs)
        if not options.quiet:
            lines = feedback.row(name, stood[name]), feedback.gain_row(name, stood[name], stood["none"])
            print(f"law {len(stood)} of {len(dict.fromkeys(names))}, and its differences to none:", *lines, sep="\n", file=sys.stderr, flush=True)
    if options.json:
        laws = [{"law": name, **vars(one), "gain": feedback.gain(one, stood["none"])} for name, one in stood.items()]
        return json.dumps({"simulation": True, "robots": len(seeds), "kind": options.kind, "heel_cycles": heel, "laws": laws})
    head = f"{len(seeds)} robots, {options.kind} seeds, {options.secs:g} s, left heel at {heel:.3f} cycles; simulation, not shown on a robot"
    return "\n".join([head, "", *feedback.tables(stood)])


def _feedback_of_loop(options: argparse.Namespace, seeds: Sequence[int]) -> str:
    """The table of what robots stand with feedback in the control loop of the boards, and without."""
    generator, share = named_generator(options.gait), options.loop
    found = board_feedback.trials(
        named_robot(options.robot), generator, options.robot_file, share, seeds, options.kind, options.secs, progress=not options.quiet
    )
    if options.json:
        each = [{"trial": name, **vars(one), "only_with": one.only_with, "only_without": one.only_without} for name, one in found.items()]
        return json.dumps({"simulation": True, "robots": len(seeds), "kind": options.kind, "feedback": share, "trials": each})
    head = f"{len(seeds)} robots, {options.kind} seeds, {options.secs:g} s, the control loop of the boards; simulation, not shown on a robot"
    return "\n".join([head, "", *board_feedback.table(found, share)])


def _error(text: str) -> None:
    print(f"error: {text}", file=sys.stderr)


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Runs the command line and returns its exit code; no unit."""
    given = sys.argv[1:] if arguments is None else list(arguments)
    if given[:1] == ["worn"]:
        return wearer_cli.main(given[1:])
    if given[:1] == ["report"]:
        return report.main(given[1:])
    options = _parser().parse_args(given)
    try:
        if options.picture is not None and not os.path.isdir(os.path.dirname(os.path.abspath(options.picture))):
            raise InputError(f"--picture {options.picture}: its folder does not exist; make it first")
        if options.picture is not None:
            picture.writer(options.picture)
        if options.robot.endswith(".toml") and options.robot_file is None:
            options.robot, options.robot_file = "desk", options.robot
        if options.body is not None:
            if options.robot != "desk":
                raise InputError(f"--robot {options.robot}: it is a body too; allowed without --body")
            if not options.body.endswith(".toml"):
                raise InputError(f"--body {options.body}: allowed is a file whose name ends with .toml")
            options.robot = options.body
        asked_gaits, speeds = options.gait or [None], options.speed or [1.0]
        if options.command != "size" and (len(asked_gaits) > 1 or len(speeds) > 1):
            raise InputError(f"--{'gait' if len(asked_gaits) > 1 else 'speed'}: several are allowed with `size`")
        options.gait, options.speed = asked_gaits[0], speeds[0]
        if options.elf is None and (options.robot_record or options.generator_record or options.sensor_record or options.exchange):
            raise InputError("--robot-record, --generator-record, --sensor-record and --exchange are of an image: allowed with --elf; without it, --robot-file and --gait")
        if options.elf is not None and (options.gait or options.speed != 1.0):
            raise InputError("--gait and --speed are of the control loop in this process: with --elf the gait is --generator-record, which `footfall pack` writes")
        if options.elf is not None and not options.robot_record:
            raise InputError("--elf needs --robot-record: without it there is no pulse; `footfall pack --robot robot.toml -o robot.bin` writes it")
        # Such an option given to another command would do nothing.
        only = [name for name in (*_SEARCH, "output", "step", "robot_output", "hold") if getattr(options, name) is not None]
        if options.command != "feedback" and (options.law or options.loop is not None):
            raise InputError(f"--{'law' if options.law else 'loop'}: allowed with `feedback`")
        if options.law and options.loop is not None:
            raise InputError("--law: the laws are computed beside the control loop; allowed without --loop")
        if options.loop == 0.0:
            raise InputError("--loop 0: that is no feedback, which is compared anyway; allowed is -0.8 to 0.8 but for 0")
        if options.command != "search" and only:
            raise InputError(f"--{only[0].replace('_', '-')}: allowed with `search`")
        if options.push and options.secs <= PUSH_AT_S:
            raise InputError(f"--push: it comes at {PUSH_AT_S:g} s; allowed with --secs above that")
        if options.command == "feedback":
            refused = [name for name in ("elf", "picture", "slope", "push", "servo", "supply") if getattr(options, name)]
            refused += ["speed"] if options.speed != 1.0 else []
            refused += [f"rig {options.rig}"] if options.rig not in (None, "free") else []
            if refused:
                raise InputError(f"--{refused[0]}: `feedback` has none; it is free in the plane, and pushes and slopes are its own")
            if options.secs <= PUSH_AT_S:
                raise InputError(f"--secs {options.secs:g}: the pushes of `feedback` come at {PUSH_AT_S:g} s; allowed is above that")
            if not (options.gait and options.robot_file):
                raise InputError("feedback needs --gait and --robot-file: a gait that walks free in the plane, and the robot file with its park pose")
            print(_feedback(options))
            return 0
        if options.command == "defaults":
            print(body_file.text_of(named_robot(options.robot)))
            return 0
        options.rig = options.rig or "boom"
        if options.command == "search":
            in_plane = options.rig == "free"
            none = ("elf", "picture", "json") if in_plane else ("elf", "picture", "json", "slope", "push")
            refused = [f"--{name.replace('_', '-')}" for name in none if getattr(options, name)]
            refused += ["--speed"] if options.speed != 1.0 else []
            if refused:
                raise InputError(f"{refused[0]}: `search` has none; allowed with `walk`, once the gait is found")
            if options.output is None or not os.path.isdir(os.path.dirname(os.path.abspath(options.output))):
                raise InputError("search needs -o FILE in a folder that exists: the generator file that it writes")
            folder = os.path.dirname(os.path.abspath(options.robot_output or ""))
            if in_plane and not (options.robot_file and options.robot_output and os.path.isdir(folder)):
                raise InputError("search --rig free needs --robot-file FILE, from whose park pose it begins, and --robot-output FILE in a folder that exists")
            if not in_plane and (options.robot_output or options.hold is not None):
                raise InputError("--robot-output, --hold: allowed with --rig free, where the park pose is searched and a spring holds the lean")
            text, may_be_used = _search(options)
            print(text)
            return 0 if may_be_used else 1
        print(_size(options, asked_gaits, speeds) if options.command == "size" else _walk(options))
        sys.stdout.flush()
    except BrokenPipeError:
        # Nobody reads on, as with `head`: no error of the run. The flush at the interpreter's end would report it once more.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
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

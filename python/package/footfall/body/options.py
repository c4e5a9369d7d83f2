"""The options of ``python -m footfall.body``, and which of them go together: an option that would do nothing is refused."""

import argparse
import math
import os
from typing import Any, Dict, List, Optional, Sequence, Tuple

from .. import servos
from .._errors import InputError
from . import feedback, picture
from .by_name import named_robot
from .model import RIGS
from .outputs import check_writable
from .search_cli import NUMBERS
from .seeds import KINDS
from .simulation import PUSH_AT_S

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


_COMMANDS = (
    "walk (if it is not given), size, search, feedback: pushes and slopes that robots withstand free in the plane, with and without feedback, or "
    "defaults: prints the body file of --robot; worn and report have options of their own"
)


class _Once(argparse.Action):
    """A body that is named twice would be the last one, silently."""

    def __call__(self, parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: Any, option_string: Optional[str] = None) -> None:
        if getattr(namespace, self.dest) is not None:
            parser.error(f"{option_string} is given twice: allowed is one; a body with a robot file is {option_string} mini --robot-file robot.toml")
        setattr(namespace, self.dest, values)


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
        action=_Once,
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
    parser.add_argument("--kind", choices=KINDS, help="how much the seeds vary: standard, if it is not given, or wide")
    of_search = parser.add_argument_group("search", "CMA-ES; each generation tries its candidates on --seeds new robots (2)")
    of_search.add_argument("-o", "--output", metavar="FILE", help="generator file that it writes")
    for option, (what, value, least, most) in NUMBERS.items():
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


#: What `search` and `feedback` refuse, and what they say of it.
_NOT_IN_SEARCH = ("elf", "picture", "json", "slope", "push")
_NOT_IN_FEEDBACK = ("elf", "picture", "slope", "push", "servo", "supply")
#: All that a gait moves if no servo does: legs that hang from a fixed trunk.
_OF_HANGING_LEGS = ("command", "robot", "body", "gait", "speed", "secs", "json", "quiet")


def _named(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _given(options: argparse.Namespace, parser: argparse.ArgumentParser) -> List[str]:
    """The options of a command line, without those that are not given."""
    return [name for name, value in vars(options).items() if value != parser.get_default(name)]


def _body(options: argparse.Namespace) -> None:
    """Puts the body, by its name or its file, in `robot`, and a robot file in `robot_file`."""
    if options.robot is not None and options.robot.endswith(".toml"):
        if options.robot_file is not None:
            raise InputError(f"--robot {options.robot} --robot-file {options.robot_file}: both are robot files; allowed is one, and for a body {_BODIES}")
        options.robot, options.robot_file = None, options.robot
    if options.body is not None:
        if options.robot is not None:
            raise InputError(f"--robot {options.robot}: it is a body too; allowed without --body")
        if not options.body.endswith(".toml"):
            raise InputError(f"--body {options.body}: allowed is a file whose name ends with .toml")
    options.robot = options.body or options.robot or "desk"


#: What names a body, in messages.
_BODIES = "--robot desk, mini or person, or --body FILE"


def _image(options: argparse.Namespace) -> None:
    """What goes with an image, and what without."""
    if options.elf is None and (options.robot_record or options.generator_record or options.sensor_record or options.exchange):
        raise InputError("--robot-record, --generator-record, --sensor-record and --exchange are of an image: allowed with --elf; without it, --robot-file and --gait")
    if options.elf is not None and (options.gait or options.speed not in (None, [1.0])):
        raise InputError("--gait and --speed are of the control loop in this process: with --elf the gait is --generator-record, which `footfall pack` writes")
    if options.elf is not None and not options.robot_record:
        raise InputError("--elf needs --robot-record: without it there is no pulse; `footfall pack --robot robot.toml -o robot.bin` writes it")


def _other_commands(options: argparse.Namespace) -> None:
    """Such an option given to another command would do nothing."""
    only = [name for name in (*NUMBERS, "output", "step", "robot_output", "hold") if getattr(options, name) is not None]
    if options.command != "feedback" and (options.law or options.loop is not None):
        raise InputError(f"--{'law' if options.law else 'loop'}: allowed with `feedback`")
    if options.command != "search" and only:
        raise InputError(f"{_named(only[0])}: allowed with `search`")
    several = [name for name in ("gait", "speed") if len(getattr(options, name) or ()) > 1]
    if options.command != "size" and several:
        raise InputError(f"{_named(several[0])}: several are allowed with `size`")


def _feedback(options: argparse.Namespace) -> None:
    if options.law and options.loop is not None:
        raise InputError("--law: the laws are computed beside the control loop; allowed without --loop")
    if options.loop == 0.0:
        raise InputError("--loop 0: that is no feedback, which is compared anyway; allowed is -0.8 to 0.8 but for 0")
    refused = [name for name in _NOT_IN_FEEDBACK if getattr(options, name)]
    refused += ["speed"] if options.speed not in (None, [1.0]) else []
    refused += [f"rig {options.rig}"] if options.rig not in (None, "free") else []
    if refused:
        raise InputError(f"--{refused[0]}: `feedback` has none; it is free in the plane, and pushes and slopes are its own")
    if options.secs <= PUSH_AT_S:
        raise InputError(f"--secs {options.secs:g}: the pushes of `feedback` come at {PUSH_AT_S:g} s; allowed is above that")
    if not (options.gait and options.robot_file):
        raise InputError("feedback needs --gait and --robot-file: a gait that walks free in the plane, and the robot file with its park pose")
    options.rig = "free"


def _search(options: argparse.Namespace) -> None:
    in_plane = options.rig == "free"
    refused = [_named(name) for name in _NOT_IN_SEARCH if getattr(options, name) and not (in_plane and name in ("slope", "push"))]
    refused += ["--speed"] if options.speed not in (None, [1.0]) else []
    if refused:
        raise InputError(f"{refused[0]}: `search` has none; allowed with `walk`, once the gait is found")
    if options.output is None:
        raise InputError("search needs -o FILE: the generator file that it writes")
    if in_plane and not (options.robot_file and options.robot_output):
        raise InputError("search --rig free needs --robot-file FILE, from whose park pose it begins, and --robot-output FILE, which it writes")
    if not in_plane and (options.robot_output or options.hold is not None):
        raise InputError("--robot-output, --hold: allowed with --rig free, where the park pose is searched and a spring holds the lean")
    if options.robot_output and os.path.realpath(options.output) == os.path.realpath(options.robot_output):
        raise InputError(f"-o and --robot-output are both {options.output}: a generator file and a robot file; allowed are two names")


def _size(options: argparse.Namespace, given: Sequence[str]) -> None:
    if options.picture is not None:
        raise InputError("--picture: `size` has none; allowed with `walk`")
    if not named_robot(options.robot).servo and options.servo is None:
        refused = [name for name in given if name not in _OF_HANGING_LEGS]
        if refused:
            raise InputError(
                f"{_named(refused[0])}: it has no effect on {options.robot}, which has no servo: `size` moves hanging legs along the gait; "
                f"allowed are {', '.join(_named(name) for name in _OF_HANGING_LEGS[2:])}, or all with --servo"
            )


def _outputs(options: argparse.Namespace) -> None:
    """Refuses what cannot be written, before the work."""
    if options.picture is not None:
        picture.writer(options.picture)
    for option, path in (("--picture", options.picture), ("-o", options.output), ("--robot-output", options.robot_output)):
        if path is not None:
            check_writable(option, path)


def read(arguments: Sequence[str]) -> Tuple[argparse.Namespace, List[Optional[str]], List[float]]:
    """The options of a command line, with the gaits and the speeds (factors without unit) that `size` may have several of; the first of each is in the options."""
    parser = _parser()
    options = parser.parse_args(arguments)
    given = _given(options, parser)
    _body(options)
    _image(options)
    _other_commands(options)
    if options.push and options.secs <= PUSH_AT_S and options.command != "feedback":
        raise InputError(f"--push: it comes at {PUSH_AT_S:g} s; allowed with --secs above that")
    if options.command == "defaults":
        refused = [name for name in given if name not in ("command", "robot", "body")] + (["robot_file"] if options.robot_file else [])
        if refused:
            raise InputError(f"{_named(refused[0])}: `defaults` has none; allowed is {_BODIES}")
    checks = {"feedback": lambda: _feedback(options), "search": lambda: _search(options), "size": lambda: _size(options, given)}
    checks.get(options.command, lambda: None)()
    if options.kind is not None and options.seeds is None and options.command in ("walk", "size"):
        raise InputError(f"--kind {options.kind}: it is of the robots of --seeds, and one nominal robot does not vary; allowed with --seeds N")
    _outputs(options)
    gaits, speeds = options.gait or [None], options.speed or [1.0]
    options.gait, options.speed = gaits[0], speeds[0]
    options.rig, options.kind = options.rig or "boom", options.kind or "standard"
    return options, gaits, speeds

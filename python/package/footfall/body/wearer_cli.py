"""The command line ``python -m footfall.body worn``: what servos do to the limbs of a person who wears them."""

import argparse
import json
import os
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple

import numpy as np

from .. import JOINTS, Generator, Servo, servos
from .._errors import FootfallError, InputError
from . import faults, picture, wearer
from .cuff import CUFFS_NM_RAD, LEVER_M, Supply, Worn, wear
from .outputs import check_writable, show
from .recorded import RECORDING, Person
from .wearer import EVENT_AT_S, OF_THE_WALK, BoardRun, Event, Pulses

_EXAMPLES = """examples:
  python -m footfall.body worn
  python -m footfall.body worn --servo DS3225 --cuff rigid --cuff 180 --event step --picture step.png
  python -m footfall.body worn --recording samples/walk.csv --event estop --no-rail-switch --json

with the flashed image (docs/body.md says how its records are written):
  python -m footfall.body worn --follower follower.toml --elf firmware.elf --robot-record robot.bin \\
      --generator-record follower.bin --sensor-record sensors.bin
  python -m footfall.body worn ... --faults tests/campaign/faults.toml --every 10

All numbers are simulation. The person is stronger than the servos, and the orthosis has no mass; docs/body.md says what that leaves out."""

#: When a fault of the campaign comes after the arming, s, and how long the torque is judged after it, s.
_FAULT_AT_S, _FAULT_SHOWN_S = 7.0, 3.0
#: A sensor fault lasts longer: 2 s of walk, then a ramp to a stand.
_SENSOR_SHOWN_S = 6.0


def _cuff(text: str) -> Optional[float]:
    if text == "rigid":
        return None
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 1.0 <= value <= 2000.0:
        raise argparse.ArgumentTypeError(f"'{text}': allowed is rigid, or 1 to 2000 N m/rad")
    return value


def _at_least_one(text: str) -> int:
    if not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"'{text}': allowed is a whole number of 1 or more")
    return int(text)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m footfall.body worn",
        description="A person walks along a recording; the recorded hip moves the sensor of a follower, whose servos drive an orthosis that is strapped "
        "to the person's legs. Prints the torque between the two at each joint.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    names = [event.name for event in wearer.events(1.0)]
    parser.add_argument("--recording", metavar="FILE", default=RECORDING, help=f"with both hips and knees; without it {RECORDING}, in a clone")
    parser.add_argument("--follower", metavar="FILE", help="follower of `footfall fit --follow`; without it, fitted to the recording's left hip")
    parser.add_argument("--sensor-file", metavar="FILE", help="calibration of the sensor; without it, the published curve")
    parser.add_argument("--servo", action="append", choices=servos(), help="may be given several times (MG996R)")
    parser.add_argument("--supply", metavar="V", type=float, help="supply of the servos, V; without it, the highest of the data sheet")
    parser.add_argument("--cuff", action="append", type=_cuff, metavar="rigid|NM_PER_RAD", help=f"may be given several times (rigid); docs/body.md has {CUFFS_NM_RAD[0]:g}, {CUFFS_NM_RAD[1]:g} and {CUFFS_NM_RAD[2]:g}")
    parser.add_argument("--event", action="append", choices=names, help="may be given several times; all of them without it")
    parser.add_argument("--no-rail-switch", action="store_true", help="no switch of the servos' supply that the board opens when its outputs go off")
    parser.add_argument("--robot-file", metavar="FILE", help="robot file with servo map and limits; the default robot without it")
    of_image = parser.add_argument_group("the flashed image", "on the virtual board, instead of the control loop in this process")
    of_image.add_argument("--elf", metavar="ELF", help="the image; FOOTFALL_VIRTUAL_BOARD names the virtual board")
    for record, what in (("robot", "robot"), ("generator", "follower"), ("sensor", "sensors")):
        of_image.add_argument(f"--{record}-record", metavar="FILE", help=f"record of the {what}, as `footfall pack` writes it")
    of_image.add_argument("--faults", metavar="FILE", help=f"instead of events, each fault of this file in the state `following`: {faults.FAULTS}")
    of_image.add_argument("--only", metavar="TEXT", help="only faults whose name contains this")
    of_image.add_argument("--every", metavar="N", type=_at_least_one, default=1, help="one fault of N (1)")
    of_image.add_argument("--jobs", metavar="N", type=_at_least_one, default=1, help="virtual boards at the same time (1)")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--picture", metavar="FILE.png", help="draw the first event with the first servo and cuff")
    parser.add_argument("--quiet", action="store_true", help="no progress")
    return parser


def _say(options: argparse.Namespace, text: str) -> None:
    if not options.quiet:
        print(text, file=sys.stderr, flush=True)


def _check(options: argparse.Namespace) -> None:
    records = ("robot_record", "generator_record", "sensor_record")
    if options.elf is None:
        given = [name for name in (*records, "faults", "only") if getattr(options, name)] + ["every"] * (options.every != 1)
        if given:
            raise InputError(f"--{given[0].replace('_', '-')}: it is of an image; allowed with --elf")
        if options.event and "reset" in options.event:
            raise InputError("--event reset: it is injected into an image; allowed with --elf")
    else:
        lacks = [f"--{name.replace('_', '-')}" for name in (*records, "follower") if not getattr(options, name)]
        if lacks:
            raise InputError(
                f"--elf needs {', '.join(lacks)}: `footfall fit RECORDING --follow left_hip -o follower.toml`, `footfall pack follower.toml -o follower.bin`, "
                "`footfall pack --robot robot.toml -o robot.bin` and `footfall pack --sensor left_hip=sensor.toml -o sensors.bin` write them"
            )
    if options.faults and (options.event or options.picture):
        raise InputError("--faults: it runs the faults of a file; --event and --picture are allowed without it")
    if (options.only or options.every != 1) and not options.faults:
        raise InputError("--only and --every choose faults: allowed with --faults")
    if options.picture is not None:
        check_writable("--picture", options.picture)
    if options.recording == RECORDING and not os.path.isfile(RECORDING):
        raise InputError(f"{RECORDING}: no such file; it is the recording of the repository: run `worn` in the folder of a clone that has README.md, or give --recording FILE")
    wearer.readable(options.recording)


def _supply_v(options: argparse.Namespace, servo: str) -> float:
    if options.supply is not None:
        # An error with the allowed range, before anything runs.
        return Servo(servo, supply_v=options.supply).supply_v
    return Servo(servo, supply_v=0.0).supply_range_v[1]


def _cases(options: argparse.Namespace) -> List[Tuple[str, float, Optional[float]]]:
    """Servo, supply and cuff of each table."""
    return [(servo, _supply_v(options, servo), cuff) for servo in options.servo or ["MG996R"] for cuff in options.cuff or [None]]


def _called(servo: str, supply_v: float, cuff: Optional[float]) -> str:
    return f"{servo} at {supply_v:g} V, " + ("rigid cuff" if cuff is None else f"cuff of {cuff:g} N m/rad")


def _image(options: argparse.Namespace, script: Optional[str] = None, event_at_s: float = EVENT_AT_S) -> BoardRun:
    """The image with its records and the text of a fault script."""
    with tempfile.TemporaryDirectory() as folder:
        path = None
        if script is not None:
            path = Path(folder) / "script.toml"
            path.write_text(script, encoding="utf-8")
        return BoardRun(
            options.elf,
            robot=options.robot_record,
            generator=options.generator_record,
            sensors=options.sensor_record,
            script=path,
            event_at_s=event_at_s,
        )


def _supplies(options: argparse.Namespace, pulses: Pulses, event: Event) -> List[Supply]:
    """What switches the servos' supply: the board, if there is such a switch, and a person's hand."""
    kept = [] if options.no_rail_switch else list(pulses.rail)
    if event.limp:
        # By hand: the board does not know of it, and does not switch it on again.
        kept = [one for one in kept if one.at_s < EVENT_AT_S] + [Supply(EVENT_AT_S, False)]
    return kept


def _worn(options: argparse.Namespace, person: Person, event: Event, pulses: Pulses, seconds: float, case: Tuple[str, float, Optional[float]]) -> Worn:
    servo, supply_v, cuff = case
    motion = wearer.finer(person, event, seconds, cuff is not None)
    # A servo whose supply goes in a pulse takes nothing from it; one that keeps its supply takes the cut pulse for a short one.
    frames = pulses.frames + (pulses.unpowered if options.no_rail_switch else [])
    supplies = _supplies(options, pulses, event)
    return wear(motion, frames, supplies, servo=servo, supply_v=supply_v, cuff_nm_rad=cuff, robot_file=options.robot_file)


def _events(options: argparse.Namespace) -> Tuple[str, Optional[Callable[[], None]]]:
    """The tables of all events, and what draws the picture."""
    person = Person(options.recording)
    follower = person.fitted.generator() if options.follower is None else Generator.read(options.follower)
    wanted = [event for event in wearer.events(person.stride_s) if event.name in (options.event or [event.name]) and (options.elf or not event.inject)]
    rows: Dict[str, List[Dict[str, Any]]] = {_called(*case): [] for case in _cases(options)}
    walk: Optional[Tuple[Pulses, Dict[str, Worn], float]] = None
    walks_s = wearer.seconds_of([event.name for event in wanted], wanted)
    locked: Optional[Pulses] = None
    draw: Optional[Callable[[], None]] = None
    for event in wanted:
        of_walk = event.name in OF_THE_WALK
        seconds = walks_s if of_walk else EVENT_AT_S + event.shown_s
        if of_walk and walk is not None:
            pulses, all_worn, _ = walk
        else:
            volts = wearer.volts(person, _sensor_joint(follower), event, seconds, sensor=options.sensor_file)
            if options.elf is None:
                pulses = wearer.by_the_loop(follower, event, volts, robot_file=options.robot_file, sensor=options.sensor_file)
            else:
                script = None if not event.inject else faults.Fault("", "", {"reset": "watchdog"}, None).script(EVENT_AT_S * 1000.0, 0.0)
                image = _image(options, script)
                pulses = image.run(volts, stop_at_s=EVENT_AT_S if event.stops else None)
                if of_walk:
                    # The image does not say when it locks; the control loop, from the same volts, does.
                    locked = wearer.by_the_loop(follower, replace(event, inject=""), volts, robot_file=options.robot_file, sensor=options.sensor_file)
                    pulses.locked_s, pulses.locked_share = locked.locked_s, locked.locked_share
            all_worn = {_called(*case): _worn(options, person, event, pulses, seconds, case) for case in _cases(options)}
            if of_walk:
                walk = (pulses, all_worn, seconds)
        from_s, to_s = wearer.span(event, pulses, seconds)
        for case in _cases(options):
            called = _called(*case)
            row: Dict[str, Any] = {"event": event.name, "what": event.text, "from_s": from_s, "to_s": to_s, "joints": wearer.judged(all_worn[called], from_s, to_s)}
            rows[called].append(row)
        if options.picture is not None and draw is None:
            called = _called(*_cases(options)[0])
            draw = partial(picture.torques, all_worn[called], from_s, to_s, options.picture, f"{event.text}; {called}")
        _say(options, f"{event.name}: done")
    bounds = {servo: _bounds(person, servo, supply_v) for servo, supply_v, _ in _cases(options)}
    locked_s = None if walk is None else walk[0].locked_s
    if options.json:
        whole = {"simulation": True, "image": options.elf is not None, "locked_s": locked_s, "bounds": bounds, "tables": rows}
        return json.dumps(whole), draw
    lines = [f"simulation, not shown on a robot or a person; {'flashed image' if options.elf else 'control loop'}, {options.recording}"]
    if walk is not None and walk[0].locked_s is not None:
        lines.append(f"locked {walk[0].locked_s - wearer.WALKS_AT_S:.2f} s after the person begins to walk, then for {100.0 * walk[0].locked_share:.0f} % of the time")
    lines.append(f"force: at a cuff {LEVER_M[JOINTS[0]]:g} m from the joint; above: more than {wearer.THRESHOLD_NM['hip']:g} (hip), {wearer.THRESHOLD_NM['knee']:g} N m (knee)")
    for called, found in rows.items():
        servo = called.split(" ")[0]
        lines += ["", f"{called}: stall {bounds[servo]['stall_nm']:.2f} N m; at most {bounds[servo]['most_nm']:.2f} N m in this walk"]
        lines.append(f"{'':8}{'':12}{'peak':>9}{'rms':>9}{'95 %':>9}{'force':>9}{'above':>9}{'pulse-leg':>11}{'servo-leg':>11}")
        lines.append(f"{'event':8}{'joint':12}{'N m':>9}{'N m':>9}{'N m':>9}{'N':>9}{'s':>9}{'deg rms':>11}{'deg rms':>11}")
        for line in found:
            for joint, one in line["joints"].items():
                name = line["event"] if joint == JOINTS[0] else ""
                cells = "".join(f"{one[key]:9.3f}" for key in ("peak_nm", "rms_nm", "p95_nm"))
                asked = one["asked_apart_rms_deg"]
                cells += f"{one['peak_n']:9.1f}{one['above_s']:9.2f}" + (f"{'-':>11}" if asked is None else f"{asked:11.2f}")
                cells += f"{one['driven_apart_rms_deg']:11.2f}"
                lines.append(f"{name:8}{joint:12}{cells}")
    return "\n".join(lines), draw


def _sensor_joint(follower: Generator) -> str:
    if follower.follows is None:
        raise InputError("--follower: the generator follows nobody; `footfall fit RECORDING --follow left_hip -o follower.toml` writes one that does")
    return follower.follows


def _bounds(person: Person, name: str, supply_v: float) -> Dict[str, float]:
    servo = Servo(name, supply_v=supply_v)
    motion = person.move(15.0, 0.001, wearer.changes_of(person, wearer.events(person.stride_s)[3]))
    return {"stall_nm": servo.stall_nm, "most_nm": max(wearer.most_nm(motion, joint, servo) for joint in JOINTS)}


def _fault(options: argparse.Namespace, person: Person, joint: str, fault: faults.Fault) -> Dict[str, Any]:
    """One fault in the image, and what it does to the limbs with each servo and cuff."""
    event, inject = Event(fault.name, fault.name, 0.0), fault.inject
    shown_s = _SENSOR_SHOWN_S if isinstance(inject, dict) and "volts" in inject else _FAULT_SHOWN_S
    seconds, late = _FAULT_AT_S + shown_s, round(_FAULT_AT_S * 1000)
    volts = wearer.volts(person, joint, event, seconds, sensor=options.sensor_file)
    # What the program that steps the board gives itself: the sensor's pin and the emergency stop.
    script: Optional[str] = fault.script(_FAULT_AT_S * 1000.0, 0.0)
    stop_at_s: Optional[float] = None
    if isinstance(inject, dict) and inject.get("volts", {}).get("pin") == "PA1":
        volts[late:], script = inject["volts"]["volts"], None
    elif isinstance(inject, dict) and inject.get("level", {}).get("pin") == "PB12":
        stop_at_s, script = _FAULT_AT_S, None
    image = _image(options, script, _FAULT_AT_S)
    pulses = image.run(volts, stop_at_s=stop_at_s)
    at_s = _FAULT_AT_S if image.injected_s is None else image.injected_s
    found = {"fault": fault.name, "group": fault.group, "injected": script is None or image.injected_s is not None, "ended": image.ended}
    found.update(violations=image.violations, off_s=next((one.at_s - at_s for one in pulses.rail if one.at_s > at_s and not one.is_on), None))
    for case in _cases(options):
        found[_called(*case)] = wearer.judged(_worn(options, person, event, pulses, seconds, case), at_s, seconds)
    return found


def _faults(options: argparse.Namespace) -> str:
    person = Person(options.recording)
    all_faults = faults.of_file(options.faults, "following", options.elf)
    chosen = [fault for fault in all_faults if options.only is None or options.only in fault.name][:: options.every]
    if not chosen:
        raise InputError(f"--only '{options.only}': no fault of {options.faults} has this in its name in the state `following`")
    joint, found = _sensor_joint(Generator.read(options.follower)), []
    with ThreadPoolExecutor(options.jobs) as pool:
        for number, one in enumerate(pool.map(lambda fault: _fault(options, person, joint, fault), chosen), 1):
            found.append(one)
            if number % 20 == 0 or number == len(chosen):
                _say(options, f"{number} of {len(chosen)} faults")
    if options.json:
        return json.dumps({"simulation": True, "faults": len(all_faults), "run": len(chosen), "each": found})
    lines = [f"simulation, not shown on a robot or a person; {len(chosen)} of {len(all_faults)} faults in the state `following`, one phase of the frame each"]
    lines.append(f"not injected: {sum(not one['injected'] for one in found)}; runs that ended early: {sum(bool(one['ended']) for one in found)}")
    groups = list(dict.fromkeys(one["group"] for one in found))
    for case in _cases(options):
        called = _called(*case)
        lines += ["", called, f"{'':52}{'':>6}{'':>7}{'hips N m':>18}{'knees N m':>18}{'supply off':>12}{'wrong':>7}"]
        lines.append(f"{'fault':52}{'runs':>6}{'off':>7}{'peak':>9}{'95 %':>9}{'peak':>9}{'95 %':>9}{'ms':>12}{'pulses':>7}")
        for group in groups:
            of_group = [one for one in found if one["group"] == group]
            cells = ""
            for kind in ("hip", "knee"):
                for key in ("peak_nm", "p95_nm"):
                    cells += f"{max(one[called][joint][key] for one in of_group for joint in JOINTS if joint.endswith(kind)):9.3f}"
            off = [one["off_s"] for one in of_group if one["off_s"] is not None]
            longest = f"{1000.0 * float(np.max(off)):12.0f}" if off else f"{'-':>12}"
            lines.append(f"{group:52}{len(of_group):6}{len(off):7}{cells}{longest}{sum(one['violations'] for one in of_group):7}")
    return "\n".join(lines)


def main(arguments: Sequence[str]) -> int:
    """Runs the command line and returns its exit code: 0 for a run, 1 for a run that failed, 2 for wrong input; no unit."""
    options = _parser().parse_args(arguments)
    try:
        _check(options)
        text, draw = (_faults(options), None) if options.faults else _events(options)
        try:
            show(text)
        finally:
            if draw is not None:
                draw()
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

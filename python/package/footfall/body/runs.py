"""The runs of a command line: one gait on the robots of some seeds, with what says afterwards what was run."""

import argparse
import sys
from dataclasses import dataclass, replace
from typing import Any, Dict, List, Optional

from .. import certify
from .._errors import FootfallError, InputError
from .board import BoardDriver
from .by_name import named_generator, named_robot
from .drivers import LoopDriver
from .gait import Gait
from .measures import fallen, hashes, measures
from .robots import Robot
from .seeds import variation
from .sensor import DEFAULT_SENSORS, sensors_of
from .simulation import Body, Trace, run


@dataclass
class Runs:
    """What came of the seeds of a command line."""

    each: List[Dict[str, Any]]
    """Seed, measures, hashes and ``limited_share`` of each run that ended; units in the names."""
    traces: List[Trace]
    """Those of `size`, else the first one: the columns of many long runs would need gigabytes."""
    asked: int
    """How many runs were asked for; no unit."""
    @property
    def limited_share(self) -> float:
        """The largest share of the control periods in which the gate limited a run; 0 with an image, which does not say it. No unit."""
        return max(float(one["limited_share"] or 0.0) for one in self.each)

    @property
    def stopped(self) -> Optional[str]:
        """A sentence, if the keyboard ended the runs early; no unit."""
        return None if len(self.each) == self.asked else f"stopped by the keyboard: {len(self.each)} of {self.asked} runs have ended"


def settings(options: argparse.Namespace) -> Dict[str, Any]:
    """What was run, as a command line says it, with the defaults that it took; units in the names."""
    robot = named_robot(options.robot)
    is_person = not (robot.servo or options.servo)
    return {
        "command": options.command,
        "rig": options.rig,
        "robot": options.robot,
        "robot_file": options.robot_file,
        "gait": _gait(options),
        "speed": options.speed,
        "secs": options.secs,
        "seeds": options.seeds,
        "kind": None if options.seeds is None else options.kind,
        "servo": None if is_person else options.servo or robot.servo,
        "supply_v": None if is_person else robot.supply_v if options.supply is None else options.supply,
        "slope_deg": options.slope,
        "push_ns": options.push,
        **({} if options.elf is None else {name: getattr(options, name) for name in ("elf", "robot_record", "generator_record", "sensor_record")}),
    }


def _gait(options: argparse.Namespace) -> str:
    if options.elf is not None:
        return str(options.generator_record or "default walk of the image")
    return str(options.gait or "default walk")


def title(options: argparse.Namespace, seed: int) -> str:
    """What a picture says above a run; units are in it."""
    parts = [f"{options.robot} on rig {options.rig}", _gait(options)]
    parts += [f"robot file {options.robot_file}"] if options.robot_file else []
    parts += [f"speed {options.speed:g}"] if options.speed != 1.0 else []
    parts += [f"servo {options.servo}"] if options.servo else []
    parts += [f"supply {options.supply:g} V"] if options.supply is not None else []
    parts += [f"slope {options.slope:g} deg"] if options.slope else []
    parts += [f"push {options.push:g} N s"] if options.push else []
    return ", ".join([*parts, f"{options.kind} seed {seed}" if seed else "nominal"])


def why_it_does_not_walk(options: argparse.Namespace, runs: Runs) -> Optional[str]:
    """Why the certificate of the gait says that it does not walk on the robot at this speed, also on standard error; ``None`` where it walks. No unit.

    Where the gate takes the gait away, the robot follows what is left of it, and its numbers look good.
    """
    if not runs.limited_share:
        # A gate that limits nothing takes nothing, and a certificate takes seconds.
        return None
    generator = named_generator(options.gait)
    if options.speed != 1.0 and generator.follows is None:
        # A certificate is of the speed 1: the shape with a shorter stride moves as the faster gait does.
        shape = Gait.of(generator)
        generator = replace(shape, stride_s=shape.stride_s / options.speed).generator()
    certificate = certify(generator, robot=options.robot_file, starts=1)
    if certificate.walks:
        return None
    why_not = certificate.walks_why_not or certificate.status
    print(
        f"warning: {options.gait or 'the default walk'} at speed {options.speed:g} does not walk on this robot, by its certificate: {why_not}. The gate limits "
        f"{100.0 * runs.limited_share:.1f} % of the control periods; change the limits of the robot file, or take another gait",
        file=sys.stderr,
        flush=True,
    )
    return why_not


def _one(options: argparse.Namespace, robot: Robot, seed: int) -> "tuple[Trace, Dict[str, Any]]":
    """One run and its numbers."""
    varied, sensors = variation(seed, options.kind), sensors_of(options.robot_file)
    body = Body(
        robot,
        options.rig,
        variation=replace(varied, slope_deg=varied.slope_deg + options.slope),
        servo=options.servo,
        supply_v=options.supply,
        robot_file=options.robot_file,
    )
    limited_share: Optional[float] = None
    if options.elf is None:
        # Without feedback the sensor is that of the joint that the generator follows.
        of_loop = None if sensors == DEFAULT_SENSORS else sensors
        generator = None if options.gait is None else named_generator(options.gait)
        driver = LoopDriver(generator, robot=options.robot_file, sensors=of_loop, speed=options.speed)
        trace = run(body, driver, options.secs, seed=seed, sensors=sensors, until=fallen, push_ns=options.push)
        stopped, limited_share = driver.stopped, driver.limited_share
    else:
        records = {"robot": options.robot_record, "generator": options.generator_record, "sensors": options.sensor_record}
        with BoardDriver(options.elf, **records) as board:
            exchange_ms = options.exchange or 1
            trace = run(body, board, options.secs, seed=seed, sensors=sensors, until=fallen, push_ns=options.push, exchange_ms=exchange_ms)
            stopped = board.stopped
    if stopped is not None:
        raise FootfallError(f"the outputs went off at {trace.time_s[-1]:.2f} s or before, seed {seed}: {stopped}")
    return trace, {"seed": seed, **measures(trace, fallen(body)), "limited_share": limited_share, **hashes(trace)}


def runs_of(options: argparse.Namespace) -> Runs:
    """The runs of all seeds; those that have ended, if the keyboard stops them after the first one."""
    robot = named_robot(options.robot)
    seeds = [0] if options.seeds is None else list(range(1, options.seeds + 1))
    sensors = sensors_of(options.robot_file)
    if options.elf is not None and sensors != DEFAULT_SENSORS and not options.sensor_record:
        names = " ".join(f"--sensor {joint}=sensor.toml" for joint, _ in sensors)
        raise InputError(f"--robot-file: a joint has feedback, so --elf needs --sensor-record; `footfall pack {names} -o sensors.bin` writes it")
    found = Runs([], [], len(seeds))
    try:
        for number, seed in enumerate(seeds, 1):
            trace, one = _one(options, robot, seed)
            found.each.append(one)
            if options.command == "size" or number == 1:
                found.traces.append(trace)
            if not options.quiet:
                end = "fallen" if one["fallen"] else "up"
                print(f"run {number} of {len(seeds)}: seed {seed}, {one['metres']:.2f} m in {one['seconds']:.1f} s, {end}", file=sys.stderr, flush=True)
    except KeyboardInterrupt:
        if not found.each:
            raise
    return found

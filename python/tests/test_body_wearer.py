"""A person who wears the robot: torques on the limbs against closed forms, energy, and a second simulation in MuJoCo. All of it is simulation."""

import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any, List, Tuple

import numpy as np
import pytest

import footfall
from conftest import ROOT

mujoco: Any = pytest.importorskip("mujoco")
pytest.importorskip("matplotlib")
from footfall.body import wearer  # noqa: E402
from footfall.body.cuff import DAMPING_SHARE, STEP_S, Supply, wear  # noqa: E402
from footfall.body.drivers import Frame  # noqa: E402
from footfall.body.recorded import RECORDING, STANDING_RAD, Change, Motion, Person  # noqa: E402

MAPS = footfall.robot()
SERVO, SUPPLY_V = "MG996R", 6.0
PLACE = footfall.JOINTS.index("left_knee")
ONE = MAPS["left_knee"]
MODEL = footfall.Servo(SERVO, supply_v=SUPPLY_V, us_per_rad=abs(ONE["us_per_rad"]))


@pytest.fixture(scope="module")
def person() -> Person:
    return Person(ROOT / RECORDING)


def frames(rad: float, seconds: float) -> List[Frame]:
    """Pulses that ask for an angle at the left knee, rad, for a time, s."""
    us = ONE["neutral_us"] + (rad - ONE["at_neutral_rad"]) * ONE["us_per_rad"]
    return [Frame(at / 50.0, (us, us, us, us)) for at in range(round(seconds * 50.0))]


def still(rad: float, seconds: float, step_s: float = 0.001) -> Motion:
    """A limb that rests."""
    time_s = np.arange(round(seconds / step_s) + 1) * step_s
    return Motion(time_s, np.full((len(time_s), 4), rad), np.zeros((len(time_s), 4)), np.zeros((len(time_s), 4)))


def knee(motion: Motion, pulses: List[Frame], **options: Any) -> Any:
    return wear(motion, pulses, options.pop("supplies", []), servo=SERVO, supply_v=SUPPLY_V, joints=["left_knee"], **options)


@pytest.mark.parametrize("cuff", [None, 180.0])
def test_a_driven_joint_at_the_recorded_angle_has_no_torque(cuff: Any) -> None:
    found = knee(still(0.5, 1.0, 0.001 if cuff is None else STEP_S), frames(0.5, 1.0), cuff_nm_rad=cuff)
    assert np.abs(found.limb_nm[:, PLACE]).max() < 1e-9 and np.abs(found.driven_rad[:, PLACE] - 0.5).max() < 1e-9


@pytest.mark.parametrize("degrees", [1.0, -2.0, 4.0, 20.0])
def test_a_constant_offset_has_the_torque_of_the_proportional_band(degrees: float) -> None:
    # The band of 5 degrees begins at the edge of the dead band of 5 us.
    dead_deg = math.degrees(5.0 / abs(ONE["us_per_rad"]))
    share = min(1.0, (abs(degrees) - dead_deg) / 5.0)
    found = knee(still(0.5, 1.0), frames(0.5 + math.radians(degrees), 1.0))
    assert found.limb_nm[-1, PLACE] == pytest.approx(math.copysign(MODEL.stall_nm * share, degrees), rel=1e-9)
    # An elastic cuff gives way, and the gear's friction may hold a part.
    elastic = knee(still(0.5, 2.0, STEP_S), frames(0.5 + math.radians(degrees), 2.0), cuff_nm_rad=180.0)
    away = elastic.driven_rad[-1, PLACE] - 0.5
    assert elastic.limb_nm[-1, PLACE] == pytest.approx(180.0 * away, abs=1e-3)
    rest = min(1.0, (abs(math.radians(degrees) - away) - math.radians(dead_deg)) / math.radians(5.0))
    assert abs(180.0 * away - math.copysign(MODEL.stall_nm * rest, degrees)) <= MODEL.friction_nm * 1.001
    assert away * degrees > 0.0


def test_a_limp_servo_is_its_gear_and_its_rotor(person: Person) -> None:
    motion = person.move(4.0, 0.001, [Change(0.5, True, 1.1)])
    found = knee(motion, frames(0.5, 4.0), supplies=[Supply(0.0, False)])
    moves = np.abs(motion.rad_s[:, PLACE]) > 0.02
    want = -MODEL.friction_nm * np.sign(motion.rad_s[:, PLACE]) - MODEL.rotor_kg_m2 * motion.rad_s2[:, PLACE]
    np.testing.assert_allclose(found.limb_nm[moves, PLACE], want[moves], atol=1e-12)
    assert not found.motor_nm.any() and np.abs(found.limb_nm).max() < 1.0


def test_a_limb_that_moves_against_full_drive_feels_more_than_the_stall_torque(person: Person) -> None:
    motion = person.move(6.0, 0.001, [Change(0.5, True, 0.9)])
    # The servo stands as the knee flexes by 60 degrees.
    found = knee(motion, frames(float(STANDING_RAD[PLACE]), 6.0))
    largest = np.abs(found.limb_nm[:, PLACE]).max()
    assert 1.5 * MODEL.stall_nm < largest <= wearer.most_nm(motion, "left_knee", MODEL)


def test_energy_is_kept(person: Person) -> None:
    """Work of the motor is that on the person, in the gear, in the cuff's damping and spring, and in the rotor's motion."""
    motion = person.move(5.0, STEP_S, [Change(0.2, True, 1.1)])
    stiffness = 30.0
    found = knee(motion, frames(0.6, 5.0), cuff_nm_rad=stiffness)
    angle, person_rad = found.driven_rad[:, PLACE], motion.rad[:, PLACE]
    damping = 2.0 * DAMPING_SHARE * math.sqrt(stiffness * MODEL.rotor_kg_m2)
    apart = angle - person_rad
    turn, moved = np.diff(angle), np.diff(person_rad)

    def work(torque: Any, by: Any) -> float:
        return float((0.5 * (torque[1:] + torque[:-1]) * by).sum())

    motor, on_person = work(found.motor_nm[:, PLACE], turn), work(found.limb_nm[:, PLACE], moved)
    gear = MODEL.friction_nm * float(np.abs(turn).sum())
    damped = damping * float((np.diff(apart) ** 2).sum() / STEP_S)
    speed = turn[-1] / STEP_S
    kept = 0.5 * stiffness * (apart[-1] ** 2 - apart[0] ** 2) + 0.5 * MODEL.rotor_kg_m2 * speed**2
    assert abs(on_person) > 0.3 and gear > 0.1
    assert motor == pytest.approx(on_person + gear + damped + kept, abs=0.02 * (abs(motor) + abs(on_person)))


def test_the_torque_is_that_of_a_leg_in_mujoco(person: Person) -> None:
    """A second simulation: a driven joint with rotor and friction in MuJoCo, and a cuff to the recorded knee."""
    stiffness, step_s, seconds = 180.0, 0.0001, 2.5
    motion = person.move(seconds, step_s, [Change(0.2, True, person.stride_s)])
    pulses = frames(0.6, seconds)
    ours = knee(person.move(seconds, STEP_S, [Change(0.2, True, person.stride_s)]), pulses, cuff_nm_rad=stiffness)
    damping = 2.0 * DAMPING_SHARE * math.sqrt(stiffness * MODEL.rotor_kg_m2)
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><option timestep="{step_s}" gravity="0 0 0" integrator="implicitfast" jacobian="dense"/><worldbody><body>
        <inertial mass="1" pos="0 0 0" diaginertia="1e-9 1e-9 1e-9"/>
        <joint name="knee" type="hinge" axis="0 1 0" armature="{MODEL.rotor_kg_m2}" frictionloss="{MODEL.friction_nm}"/></body></worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    data.qpos[0] = motion.rad[0, PLACE]
    servo = footfall.Servo(SERVO, supply_v=SUPPLY_V, us_per_rad=abs(ONE["us_per_rad"]))
    sign, next_, torques = math.copysign(1.0, ONE["us_per_rad"]), 0, []
    for row, now in enumerate(motion.time_s[:-1].tolist()):
        while next_ < len(pulses) and pulses[next_].time_s + pulses[next_].us[PLACE] / 1e6 <= now:
            servo.pulse(pulses[next_].time_s + pulses[next_].us[PLACE] / 1e6, pulses[next_].us[PLACE])
            next_ += 1
        angle, speed = float(data.qpos[0]), float(data.qvel[0])
        shaft = (ONE["neutral_us"] - 1500.0 + (angle - ONE["at_neutral_rad"]) * ONE["us_per_rad"]) / abs(ONE["us_per_rad"])
        limb = stiffness * (angle - motion.rad[row, PLACE]) + damping * (speed - motion.rad_s[row, PLACE])
        torques.append(limb)
        data.qfrc_applied[0] = sign * servo.torque(now, shaft, sign * speed) - limb
        mujoco.mj_step(model, data)
    theirs = np.array(torques)[:: round(STEP_S / step_s)]
    mine = ours.limb_nm[: len(theirs), PLACE]
    assert float(np.sqrt(np.mean(theirs**2))) > 0.3
    # A step of 0.2 ms beside one of 0.1 ms.
    assert float(np.sqrt(np.mean((mine - theirs) ** 2))) < 0.02 * float(np.sqrt(np.mean(theirs**2)))


def test_the_motion_is_the_recording_and_has_its_derivatives(person: Person) -> None:
    repaired = footfall.read(ROOT / RECORDING).condition(low_pass="customary")
    first_s = person.fitted.stride_spans_s[0][0]
    motion = person.move(person.loop_s, 0.001, [Change(-1.0, True, person.stride_s)], 0.0)
    for place, joint in enumerate(footfall.JOINTS):
        recorded = np.interp(first_s + motion.time_s, repaired.time_s, repaired.angles_rad[:, repaired.joints.index(joint)])
        # Half of the difference of the ends is taken away at each of them.
        assert np.degrees(np.abs(motion.rad[:, place] - recorded).max()) < 0.3 + abs(np.degrees(person.seam_rad[place])), joint
    long = person.move(8.0, 0.001, [Change(1.0, True, 1.1), Change(4.0, True, 0.9), Change(7.0, False, 0.9)])
    np.testing.assert_allclose(np.gradient(long.rad, 0.001, axis=0)[2:-2], long.rad_s[2:-2], atol=0.02)
    np.testing.assert_allclose(np.gradient(long.rad_s, 0.001, axis=0)[2:-2], long.rad_s2[2:-2], atol=1.0)
    np.testing.assert_allclose(long.rad[:1000], np.tile(STANDING_RAD, (1000, 1)), atol=1e-12)
    np.testing.assert_allclose(long.rad[-1], STANDING_RAD, atol=1e-12)
    # Upward crossings of the knee through its middle are a stride apart.
    knee_rad = long.rad[4300:7000, PLACE]
    middle = 0.5 * (knee_rad.max() + knee_rad.min())
    ups = np.flatnonzero((knee_rad[1:] >= middle) & (knee_rad[:-1] < middle))
    assert np.diff(ups).mean() == pytest.approx(900.0, abs=25.0)


def event(person: Person, name: str) -> wearer.Event:
    return next(one for one in wearer.events(person.stride_s) if one.name == name)


def of_loop(person: Person, name: str, seconds: float) -> Tuple[wearer.Event, wearer.Pulses]:
    one = event(person, name)
    volts = wearer.volts(person, "left_hip", one, seconds)
    return one, wearer.by_the_loop(person.fitted.generator(), one, volts)


def test_the_control_loop_locks_and_its_servos_come_close(person: Person) -> None:
    one, pulses = of_loop(person, "steady", 14.0)
    assert pulses.locked_s is not None and pulses.locked_s < wearer.WALKS_AT_S + 3.5 and pulses.locked_share > 0.99
    motion = wearer.finer(person, one, 14.0, False)
    found = wear(motion, pulses.frames, pulses.rail, servo=SERVO, supply_v=SUPPLY_V)
    before, steady = (wearer.judged(found, *wearer.span(event(person, name), pulses, 14.0)) for name in ("before", "steady"))
    for joint in footfall.JOINTS:
        # Pulses stand before the lock, and are the recorded angle of up to a servo frame ago after it.
        assert steady[joint]["asked_apart_rms_deg"] < 4.5 < 10.0 < before[joint]["asked_apart_rms_deg"], joint
        assert steady[joint]["peak_n"] == pytest.approx(steady[joint]["peak_nm"] / 0.29)
    assert steady["left_hip"]["rms_nm"] < 0.6 * before["left_hip"]["rms_nm"]


def test_a_stop_takes_the_torque_only_with_a_switch_in_the_supply(person: Person) -> None:
    one, pulses = of_loop(person, "estop", 12.0)
    assert pulses.frames[-1].time_s <= wearer.EVENT_AT_S and not pulses.rail[-1].is_on
    assert pulses.rail[-1].at_s == pytest.approx(wearer.EVENT_AT_S, abs=0.002)
    motion = wearer.finer(person, one, 12.0, False)
    late = motion.time_s > wearer.EVENT_AT_S + 0.06

    def motor(servo: str, supply_v: float, rail: List[Supply]) -> float:
        found = wear(motion, pulses.frames, rail, servo=servo, supply_v=supply_v)
        return float(np.abs(found.motor_nm[late]).max())

    assert motor("MG996R", 6.0, pulses.rail) == 0.0 and motor("MG996R", 6.0, []) == 0.0
    # A digital servo holds its last angle: full torque, and more against the person's motion.
    assert motor("DS3225", 6.8, pulses.rail) == 0.0 and motor("DS3225", 6.8, []) > 2.4


def run(*arguments: object) -> Tuple[int, str, str]:
    command: List[str] = [sys.executable, "-m", "footfall.body", "worn", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=ROOT)
    return done.returncode, done.stdout, done.stderr


def test_the_command_prints_a_table_and_draws(tmp_path: Path) -> None:
    picture = tmp_path / "step.png"
    code, output, messages = run("--event", "step", "--event", "estop", "--cuff", "rigid", "--cuff", 180, "--picture", picture)
    assert code == 0, messages
    assert output.startswith("simulation") and output.count("left_knee") == 4 and "180 N m/rad" in output
    assert picture.read_bytes().startswith(b"\x89PNG")
    code, output, messages = run("--event", "estop", "--servo", "DS3225", "--no-rail-switch", "--json", "--quiet")
    (table,) = json.loads(output)["tables"].values()
    assert code == 0 and table[0]["joints"]["left_knee"]["motor_until_s"] > 1.9, messages
    code, output, messages = run("--recording", "samples/walk.csv", "--event", "limp", "--json", "--quiet")
    assert code == 0 and messages == "", messages
    found = json.loads(output)
    (table,) = found["tables"].values()
    assert table[0]["joints"]["left_hip"]["asked_apart_rms_deg"] is None, "without supply a servo is asked for nothing"
    assert found["simulation"] and 0.05 < table[0]["joints"]["left_hip"]["peak_nm"] < 0.5


@pytest.mark.parametrize(
    "arguments,words",
    [
        (["--recording", "missing.csv"], "missing.csv"),
        (["--event", "reset"], "allowed with --elf"),
        (["--event", "fall"], "before"),
        (["--cuff", "0"], "allowed is rigid, or 1 to 2000 N m/rad"),
        (["--supply", "12"], "allowed is 4.8 to 6 V"),
        (["--faults", "tests/campaign/faults.toml"], "allowed with --elf"),
        (["--elf", "firmware.elf"], "--elf needs --robot-record"),
        (["--follower", "samples/generator.toml", "--event", "steady"], "follows nobody"),
        (["--recording", "samples/rows.csv"], "rows.csv"),
    ],
)
def test_wrong_input_is_exit_code_2_and_says_what_is_allowed(arguments: List[str], words: str) -> None:
    code, output, messages = run(*arguments)
    assert code == 2 and output == "" and words in messages and "Traceback" not in messages, messages


def test_the_threshold_is_a_tenth_of_what_a_person_s_leg_needs() -> None:
    from footfall.body.size import by_inverse_dynamics
    from footfall.body.robots import person as of_a_person

    rows, _ = by_inverse_dynamics(of_a_person(), footfall.Generator.default(), 3.0)
    for row in rows:
        assert wearer.THRESHOLD_NM[row["joint"].split("_")[1]] == pytest.approx(0.1 * row["torque_100_nm"], rel=0.02)

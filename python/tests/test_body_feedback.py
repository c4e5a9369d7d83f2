"""Feedback free in the plane: runs without it are those of the boards' pulses, heels are felt, and laws act. All of it is simulation."""

import json
import math
import re
import subprocess
import sys
from pathlib import Path
from typing import Any, Dict, List

import numpy as np
import pytest

import footfall
from conftest import ROOT

pytest.importorskip("mujoco")
body: Any = pytest.importorskip("footfall.body")
from footfall.body.board_feedback import KNEES, TRIALS, Trial, mcnemar, table, wilson, with_share  # noqa: E402
from footfall.body.feedback import LADDERS, LAWS, Law, Limits, closed, gain, gait_of, interval, pressed, shaped, tables  # noqa: E402
from footfall.body.plane import with_park  # noqa: E402
from footfall.body.rollouts import Ride, outcomes  # noqa: E402
from footfall.body.sensor import sensors_of  # noqa: E402

#: The robot file of the gait that walks free in the plane.
FREE_ROBOT = ROOT / "python" / "walks" / "desk-free-robot.toml"

#: A spring that holds the lean, N m for 1 rad, so that any gait walks.
HOLD_NM = 6.0
#: Quick and short steps.
GAIT = body.Gait(0.5, np.array([5.7, 19.0, 3.9, 7.7, -2.5]), np.array([29.1, 17.2, -1.9, 0.7, -14.3, -7.9, -1.7]))


@pytest.fixture(scope="module")
def robot_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("robot") / "robot.toml"
    file.write_text(with_park((ROOT / "samples" / "robot.toml").read_text(encoding="utf-8"), (12.0, -12.0, 10.0, 10.0)), encoding="utf-8")
    return file


@pytest.fixture(scope="module")
def rides(robot_file: Path) -> List[Ride]:
    """Two robots whose lean a spring holds, and the pulses that the boards give them."""
    frames = body.LoopDriver.pulses(GAIT.generator(), 5.3, robot=robot_file).frames
    varied = (body.variation(seed, "wide") for seed in (1, 2))
    return [Ride(body.Body(body.DESK, "free", variation=one, robot_file=robot_file), frames, 0.1, HOLD_NM) for one in varied]


def walked(rides: List[Ride], robot_file: Path, law: Law, heel_cycles: float = 0.0) -> Any:
    return closed(rides, GAIT, law, 5.3, robot_file=robot_file, heel_cycles=heel_cycles)


def test_without_feedback_it_is_the_run_of_the_boards_pulses(rides: List[Ride], robot_file: Path) -> None:
    found = walked(rides, robot_file, Law())
    for one, other in zip(found.outcomes, outcomes(rides, 5.3)):
        assert one.metres == pytest.approx(other.metres, rel=0.005) and one.metres > 1.5
        assert not one.fallen and not other.fallen
    pulses = body.LoopDriver.pulses(GAIT.generator(), 5.3, robot=robot_file)
    assert found.limited_share == pytest.approx(pulses.limited_share, abs=0.01)


def test_the_left_heel_is_felt_once_a_stride_at_one_phase(rides: List[Ride], robot_file: Path) -> None:
    for phases in walked(rides, robot_file, Law()).heel_cycles:
        # From the end of the ramp, at 2 s, on.
        assert 6 <= len(phases) <= 7 and float(np.ptp(phases)) < 0.05


def test_a_reset_that_asks_for_later_phases_makes_strides_shorter(rides: List[Ride], robot_file: Path) -> None:
    before = walked(rides, robot_file, Law()).heel_cycles
    phase = float(np.mean(before[0]))
    kept, put, back = (walked(rides, robot_file, Law(reset=share), phase + by).heel_cycles for share, by in ((1.0, 0.0), (1.0, 0.2), (-1.0, 0.2)))
    assert len(put[0]) > len(kept[0]) and abs(len(kept[0]) - len(before[0])) <= 1
    assert len(back[0]) < len(kept[0]), "a law of the other sign makes them longer"


def test_each_law_moves_the_joints_to_its_side() -> None:
    """Signs and sizes by hand: an early contact, at a pose with the left hip in front of the hips' mean and the right one behind."""
    mean = math.radians(GAIT.hip_deg[0])
    pattern, early = np.array([[[mean + 0.3, mean - 0.2, 0.5, 0.1]] * 3]), np.array([0.1])
    for law, moved in [
        (Law(hip_deg=20.0), [math.radians(2.0)] * 2 + [0.0, 0.0]),
        (Law(knee_deg=20.0), [0.0, 0.0] + [math.radians(2.0)] * 2),
        # A longer step: the hips farther from each other.
        (Law(step=2.0), [0.2 * 0.3, -0.2 * 0.2, 0.0, 0.0]),
        (Law(hip_deg=20.0, step=2.0), [math.radians(2.0) + 0.06, math.radians(2.0) - 0.04, 0.0, 0.0]),
    ]:
        np.testing.assert_allclose(shaped(law, GAIT, pattern, early) - pattern, np.broadcast_to(moved, (1, 3, 4)), atol=1e-12)
        # Late: to the other side.
        np.testing.assert_allclose(shaped(law, GAIT, pattern, -early) - pattern, np.broadcast_to(np.negative(moved), (1, 3, 4)), atol=1e-12)
    # A joint that hangs behind its setpoint is asked for more by a stiffer law, and for less by a softer one.
    setpoints, angles = np.array([[0.4, 0.1, 0.5, 0.2]]), np.array([[0.3, 0.2, 0.3, 0.2]])
    moved_rad = pressed(Law(hips=-0.5, knees=0.5), pattern, setpoints, angles) - pattern
    np.testing.assert_allclose(moved_rad, np.broadcast_to([-0.05, 0.05, 0.1, 0.0], (1, 3, 4)), atol=1e-12)


@pytest.mark.parametrize("law", [Law(hip_deg=60.0), Law(step=2.0), Law(knee_deg=60.0), Law(hips=-0.3), Law(knees=0.3)])
def test_the_other_laws_change_the_walk(rides: List[Ride], robot_file: Path, law: Law) -> None:
    without, found = walked(rides, robot_file, Law()).outcomes, walked(rides, robot_file, law, 0.2).outcomes
    assert all(abs(one.metres - other.metres) > 0.001 for one, other in zip(found, without))


def test_the_gate_limits_what_a_law_asks_for(rides: List[Ride], robot_file: Path) -> None:
    assert walked(rides, robot_file, Law(hips=3.0)).limited_share > walked(rides, robot_file, Law(hips=0.1)).limited_share + 0.1


def test_differences_are_robot_by_robot_and_the_top_of_a_ladder_is_counted() -> None:
    none = Limits([False, False], [0.1, 0.5], [0.2, 0.2], [1.0, 2.0], [0.0, 0.5], 0.0)
    law = Limits([False, True], [0.2, 0.6], [0.2, 0.0], [1.0, 6.0], [0.5, 0.0], 0.25)
    found = gain(law, none)
    assert found["forwards_ns"] == (pytest.approx(0.1), None, None), "two robots have no interval"
    assert found["backwards_ns"][0] == pytest.approx(-0.1) and found["up_deg"][0] == pytest.approx(2.0)
    assert [law.at_the_top(name) for name in LADDERS] == [1, 0, 1, 0]
    lines = tables({"none": none, "softer": law})
    assert lines[3].startswith("| softer | 1 of 2 | 25.0 | 0.400 (-), 1 |") and lines[-1].startswith("| softer | +0.100 (-) |")


def test_ten_robots_have_an_interval() -> None:
    none, law = (Limits([False] * 10, forwards, [0.2] * 10, [1.0] * 10, [0.5] * 10, 0.0) for forwards in ([0.1, 0.5] * 5, [0.2, 0.6] * 5))
    assert gain(law, none)["forwards_ns"] == pytest.approx((0.1, 0.1, 0.1)), "the robots differ, their differences do not"
    lines = tables({"none": none, "softer": law})
    assert re.match(r"\| softer \| 0 of 10 \| 0.0 \| 0.400 \(0\.[23]\d\d to 0\.[45]\d\d\), 5 \|", lines[3]), lines[3]
    assert lines[-1].startswith("| softer | +0.100 (+0.100 to +0.100) |")


def test_the_command_prints_what_robots_stand_with_a_law_and_the_difference_to_none() -> None:
    options = ["--gait", "python/walks/desk-free.toml", "--robot-file", "python/walks/desk-free-robot.toml", "--secs", "5.5", "--seeds", "1"]
    command = [sys.executable, "-m", "footfall.body", "feedback", *options, "--law", "hips softer 0.7", "--json", "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    found: Dict[str, Any] = json.loads(done.stdout)
    none, law = found["laws"]
    assert (none["law"], law["law"], found["robots"]) == ("none", "hips softer 0.7", 1) and none["fallen"] == [False]
    assert [found[name] for name in ("gait", "robot_file", "robot", "secs")] == [options[1], options[3], "desk", 5.5]
    for name in LADDERS:
        assert none["gain"][name] == [0.0, None, None]
        assert law["gain"][name][0] == pytest.approx(np.mean(law[name]) - np.mean(none[name])) and max(none[name]) > 0.0
    assert law["limited_share"] > none["limited_share"] == 0.0


def test_the_interval_is_that_of_the_mean() -> None:
    given = np.random.default_rng(7).normal(3.0, 1.0, 400)
    mean, low, high = interval(given.tolist())
    assert mean == pytest.approx(given.mean())
    # The normal approximation: 1.96 standard errors.
    assert [low - mean, high - mean] == pytest.approx([-0.098 * given.std(), 0.098 * given.std()], rel=0.1)
    assert interval([2.0, 2.0, 2.0]) == (2.0, 2.0, 2.0)
    assert LAWS["none"] == Law()


def feedback_file(folder: Path, share: float) -> Path:
    """The robot file of the gait that walks free in the plane, with feedback at both knees."""
    file = folder / "robot.toml"
    file.write_text(with_share(FREE_ROBOT.read_text(encoding="utf-8"), share), encoding="utf-8")
    return file


def test_a_share_is_that_of_both_knees_and_of_no_other_joint(tmp_path: Path) -> None:
    for share in (0.3, -0.25):
        file = feedback_file(tmp_path, share)
        shares = {joint: one["feedback"] for joint, one in footfall.robot(file).items()}
        assert shares == pytest.approx({"left_hip": 0.0, "right_hip": 0.0, "left_knee": share, "right_knee": share})
        # Another share takes its place, and none is the file without it.
        assert with_share(file.read_text(encoding="utf-8"), 0.0) == FREE_ROBOT.read_text(encoding="utf-8")
    assert sensors_of(file) == (("left_knee", None), ("right_knee", None)) and sensors_of(FREE_ROBOT) == (("left_knee", None),)
    with pytest.raises(footfall.InputError, match="0 tables"):
        with_share("[left_hip]\n", 0.3)


def test_the_control_loop_feeds_back_what_the_sensors_of_the_knees_show(tmp_path: Path) -> None:
    """By hand from the sensors' angles: in each servo frame the share of the distance of the knee to the setpoint of the pulse before."""
    share, gait = 0.3, footfall.Generator.read(ROOT / "python" / "walks" / "desk-free.toml")
    files = (feedback_file(tmp_path, share), FREE_ROBOT)
    drivers = [body.LoopDriver(gait, robot=file, sensors=KNEES) for file in files]
    volts = [float(footfall.sensor_volts(np.radians([deg]))[0]) for deg in (30.0, 10.0)]
    for driver in drivers:
        driver.arm(volts)
    noise, ticks = np.random.default_rng(3), []
    for _ in range(4000):
        now = [volt + float(noise.normal(0.0, 0.004)) for volt in volts]
        for driver in drivers:
            driver.step(1000, now)
        ticks.append([driver._loop.last for driver in drivers])
    first, checked = ticks[0][0].tick, 0
    for pulse in range(first - first % 20 + 39, first + 3960, 20):
        # 18 ms later the setpoint is where the law wants it, unless the gate still moves it there.
        fed_back, plain = ticks[pulse + 18 - first]
        if fed_back.state != "walking" or fed_back.limited:
            continue
        assert plain.limited == 0
        before, measured = ticks[pulse - 20 - first][0].setpoints_rad, ticks[pulse - first][0].measured_rad
        for place in (2, 3):
            wanted = np.clip(share * (before[place] - measured[place - 2]), -math.radians(10.0), math.radians(10.0))
            assert fed_back.setpoints_rad[place] - plain.setpoints_rad[place] == pytest.approx(wanted, abs=1e-5)
        checked += 1
    assert checked > 20


def test_stands_are_counted_pair_by_pair() -> None:
    """Wilson's interval by the solution of his equation, McNemar's p by hand."""
    for count, of in ((0, 50), (13, 50), (50, 50)):
        for bound in wilson(count, of):
            # A share at the bound is 1.96 of its own standard errors from the one that was seen.
            assert abs(count / of - bound) == pytest.approx(1.959964 * math.sqrt(bound * (1.0 - bound) / of), abs=1e-7)
    assert wilson(13, 50)[0] < 0.26 < wilson(13, 50)[1]
    assert mcnemar(0, 0) == 1.0 and mcnemar(3, 3) == 1.0
    assert mcnemar(0, 5) == mcnemar(5, 0) == pytest.approx(2.0 / 32.0)
    assert mcnemar(1, 9) == pytest.approx(2.0 * 11.0 / 1024.0)
    one = Trial([True, False, False, True], [True, True, True, False], 0.125)
    assert (one.only_with, one.only_without) == (2, 1)
    assert table({"a push": one}, 0.3)[-1] == "| a push | 2 of 4 (15 to 85 %) | 3 of 4 (30 to 95 %) | 2, 1 | 1 | 12.5 |"


def test_the_command_tries_the_control_loop_with_feedback_and_without() -> None:
    options = ["--gait", "python/walks/desk-free.toml", "--robot-file", str(FREE_ROBOT), "--secs", "5.5", "--seeds", "1", "--loop", "0.3"]
    command = [sys.executable, "-m", "footfall.body", "feedback", *options, "--json", "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    found: Dict[str, Any] = json.loads(done.stdout)
    assert (found["robots"], found["feedback"]) == (1, 0.3) and [one["trial"] for one in found["trials"]] == list(TRIALS)
    undisturbed = found["trials"][0]
    assert undisturbed["without"] == undisturbed["with_share"] == [True] and undisturbed["limited_share"] > 0.02


def test_pulses_without_a_body_are_none_of_a_robot_with_feedback(tmp_path: Path) -> None:
    with pytest.raises(footfall.InputError, match="feedback of left_knee"):
        body.LoopDriver.pulses(GAIT.generator(), 1.0, robot=feedback_file(tmp_path, 0.3))
    with pytest.raises(footfall.InputError, match="right_knee has no sensor"):
        body.LoopDriver(GAIT.generator(), robot=feedback_file(tmp_path, 0.3))


@pytest.mark.parametrize(
    "arguments,words",
    [
        (["feedback"], "needs --gait and --robot-file"),
        (["feedback", "--gait", "natural-walk", "--robot-file", "samples/robot.toml", "--push", "0.1"], "--push: `feedback` has none"),
        (["feedback", "--generations", "3"], "--generations: allowed with `search`"),
        (["feedback", "--gait", "natural-walk", "--robot-file", "samples/robot.toml", "--secs", "5"], "come at 5 s; allowed is above that"),
        (["walk", "--law", "none"], "--law: allowed with `feedback`"),
        (["walk", "--loop", "0.3"], "--loop: allowed with `feedback`"),
        (["feedback", "--loop", "0.9"], "allowed is -0.8 to 0.8"),
        (["feedback", "--loop", "0"], "--loop 0: that is no feedback"),
        (["feedback", "--loop", "0.3", "--law", "none"], "--law: the laws are computed beside the control loop"),
        (["feedback", "--rig", "boom"], "--rig boom: `feedback` has none"),
        (["feedback", "--rig", "hung"], "--rig hung: `feedback` has none"),
        (["search", "--rig", "free", "-o", "walk.toml"], "--robot-output FILE"),
        (["search", "--robot-output", "robot.toml", "-o", "walk.toml"], "allowed with --rig free"),
    ],
)
def test_wrong_input_is_exit_code_2_and_says_what_is_allowed(arguments: List[str], words: str) -> None:
    done = subprocess.run([sys.executable, "-m", "footfall.body", *arguments], capture_output=True, text=True, timeout=120, cwd=ROOT)
    assert done.returncode == 2 and done.stdout == "" and words in done.stderr and "Traceback" not in done.stderr, done.stderr
    assert not (ROOT / "walk.toml").exists()


def test_a_gait_whose_legs_differ_is_refused(tmp_path: Path) -> None:
    """Its other leg would be another one: one hip of the shipped gait is 5 degrees further."""
    text = (ROOT / "python" / "walks" / "desk-free.toml").read_text(encoding="utf-8")
    joint = re.search(r"(?ms)^\[shape\.right_hip\].*?^mean_deg *= *([-0-9.e]+)", text)
    assert joint is not None
    (tmp_path / "gait.toml").write_text(text[: joint.start(1)] + str(float(joint.group(1)) + 5.0) + text[joint.end(1) :], encoding="utf-8")
    with pytest.raises(footfall.InputError, match=r"differ by up to [0-9]+ us .* whose legs do the same"):
        gait_of(footfall.Generator.read(tmp_path / "gait.toml"), FREE_ROBOT)
    gait_of(footfall.Generator.read(ROOT / "python" / "walks" / "desk-free.toml"), FREE_ROBOT)


def test_a_gait_that_falls_is_no_gait_for_feedback(tmp_path: Path) -> None:
    arguments = ["feedback", "--gait", "python/walks/desk-boom.toml", "--robot-file", "samples/robot.toml"]
    done = subprocess.run([sys.executable, "-m", "footfall.body", *arguments], capture_output=True, text=True, timeout=120, cwd=ROOT)
    assert done.returncode == 1 and "does not walk free in the plane" in done.stderr

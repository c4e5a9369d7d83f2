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

from conftest import ROOT

pytest.importorskip("mujoco")
body: Any = pytest.importorskip("footfall.body")
from footfall.body.feedback import LADDERS, LAWS, Law, Limits, closed, gain, interval, pressed, shaped, tables  # noqa: E402
from footfall.body.plane import with_park  # noqa: E402
from footfall.body.rollouts import Ride, outcomes  # noqa: E402

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
    assert all(abs(one.metres - other.metres) > 0.005 for one, other in zip(found, without))


def test_the_gate_limits_what_a_law_asks_for(rides: List[Ride], robot_file: Path) -> None:
    assert walked(rides, robot_file, Law(hips=3.0)).limited_share > walked(rides, robot_file, Law(hips=0.1)).limited_share + 0.1


def test_differences_are_robot_by_robot_and_the_top_of_a_ladder_is_counted() -> None:
    none = Limits([False, False], [0.1, 0.5], [0.2, 0.2], [1.0, 2.0], [0.0, 0.5], 0.0)
    law = Limits([False, True], [0.2, 0.6], [0.2, 0.0], [1.0, 6.0], [0.5, 0.0], 0.25)
    found = gain(law, none)
    assert found["forwards_ns"] == pytest.approx((0.1, 0.1, 0.1)), "the robots differ, their differences do not"
    assert found["backwards_ns"][0] == pytest.approx(-0.1) and found["up_deg"][0] == pytest.approx(2.0)
    assert [law.at_the_top(name) for name in LADDERS] == [1, 0, 1, 0]
    lines = tables({"none": none, "softer": law})
    assert lines[3].startswith("| softer | 1 of 2 | 25.0 | 0.400 (0.200 to 0.600), 1 |")
    assert lines[-1].startswith("| softer | +0.100 (+0.100 to +0.100) |")


def test_the_page_has_both_lines_of_each_law() -> None:
    lines = (ROOT / "docs" / "body.md").read_text(encoding="utf-8").splitlines()
    for name in LAWS:
        found = [line for line in lines if line.startswith(f"| {name} | ")]
        assert len(found) == (1 if name == "none" else 2), name
        assert re.match(r"\| [^|]+ \| \d+ of 50 \| ", found[0]) and all(re.match(r"\| [^|]+ \| [+-]\d", line) for line in found[1:]), name


def test_the_command_prints_what_robots_stand_with_a_law_and_the_difference_to_none() -> None:
    options = ["--gait", "python/walks/desk-free.toml", "--robot-file", "python/walks/desk-free-robot.toml", "--secs", "5.5", "--seeds", "1"]
    command = [sys.executable, "-m", "footfall.body", "feedback", *options, "--law", "hips softer 0.7", "--json", "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    found: Dict[str, Any] = json.loads(done.stdout)
    none, law = found["laws"]
    assert (none["law"], law["law"], found["robots"]) == ("none", "hips softer 0.7", 1) and none["fallen"] == [False]
    for name in LADDERS:
        assert none["gain"][name] == [0.0, 0.0, 0.0]
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


@pytest.mark.parametrize(
    "arguments,words",
    [
        (["feedback"], "needs --gait and --robot-file"),
        (["feedback", "--gait", "natural-walk", "--robot-file", "samples/robot.toml", "--push", "0.1"], "--push: `feedback` has none"),
        (["feedback", "--generations", "3"], "--generations: allowed with `search`"),
        (["feedback", "--gait", "natural-walk", "--robot-file", "samples/robot.toml", "--secs", "5"], "come at 5 s; allowed is above that"),
        (["walk", "--law", "none"], "--law: allowed with `feedback`"),
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


def test_a_gait_that_falls_is_no_gait_for_feedback(tmp_path: Path) -> None:
    arguments = ["feedback", "--gait", "python/walks/desk-boom.toml", "--robot-file", "samples/robot.toml"]
    done = subprocess.run([sys.executable, "-m", "footfall.body", *arguments], capture_output=True, text=True, timeout=120, cwd=ROOT)
    assert done.returncode == 1 and "does not walk free in the plane" in done.stderr

"""Feedback free in the plane: runs without it are those of the boards' pulses, heels are felt, and laws act. All of it is simulation."""

import subprocess
import sys
from pathlib import Path
from typing import Any, List, Tuple

import numpy as np
import pytest

import footfall
from conftest import ROOT

pytest.importorskip("mujoco")
body: Any = pytest.importorskip("footfall.body")
from footfall.body.feedback import LAWS, Law, closed, interval  # noqa: E402
from footfall.body.plane import with_park  # noqa: E402
from footfall.body.rollouts import Outcome, Ride, outcomes  # noqa: E402

#: A spring that holds the lean, N m for 1 rad, so that any gait walks.
HOLD_NM = 6.0
#: Quick and short steps.
GAIT = body.Gait(0.5, np.array([5.7, 19.0, 3.9, 7.7, -2.5]), np.array([29.1, 17.2, -1.9, 0.7, -14.3, -7.9, -1.7]))


@pytest.fixture(scope="module")
def rides(tmp_path_factory: pytest.TempPathFactory) -> List[Ride]:
    """Two robots whose lean a spring holds, and the pulses that the boards give them."""
    file = tmp_path_factory.mktemp("robot") / "robot.toml"
    file.write_text(with_park((ROOT / "samples" / "robot.toml").read_text(encoding="utf-8"), (12.0, -12.0, 10.0, 10.0)), encoding="utf-8")
    frames = body.LoopDriver.pulses(GAIT.generator(), 5.3, robot=file).frames
    varied = (body.variation(seed, "wide") for seed in (1, 2))
    return [Ride(body.Body(body.DESK, "free", variation=one, robot_file=file), frames, 0.1, HOLD_NM) for one in varied]


def walked(rides: List[Ride], law: Law, heel_cycles: float = 0.0) -> Tuple[List[Outcome], List[List[float]]]:
    return closed(rides, GAIT, law, 5.3, heel_cycles)


def test_without_feedback_it_is_the_run_of_the_boards_pulses(rides: List[Ride]) -> None:
    found, _ = walked(rides, Law())
    for one, other in zip(found, outcomes(rides, 5.3)):
        assert one.metres == pytest.approx(other.metres, rel=0.005) and one.metres > 1.5
        assert not one.fallen and not other.fallen


def test_the_left_heel_is_felt_once_a_stride_at_one_phase(rides: List[Ride]) -> None:
    _, heels = walked(rides, Law())
    for phases in heels:
        # From the end of the ramp, at 2 s, on.
        assert 6 <= len(phases) <= 7 and float(np.ptp(phases)) < 0.05


def test_a_reset_that_asks_for_later_phases_makes_strides_shorter(rides: List[Ride]) -> None:
    _, before = walked(rides, Law())
    phase = float(np.mean(before[0]))
    _, kept = walked(rides, Law(reset=1.0), phase)
    _, put = walked(rides, Law(reset=1.0), phase + 0.2)
    assert len(put[0]) > len(kept[0]) and abs(len(kept[0]) - len(before[0])) <= 1


@pytest.mark.parametrize("law", [Law(hip_deg=60.0), Law(stiffer=0.3), Law(stiffer=-0.3)])
def test_the_other_laws_change_the_walk(rides: List[Ride], law: Law) -> None:
    without, _ = walked(rides, Law())
    found, _ = walked(rides, law, 0.2)
    assert all(abs(one.metres - other.metres) > 0.005 for one, other in zip(found, without))


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

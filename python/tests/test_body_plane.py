"""The walk free in the plane: quick runs and exact ones, the search for gait and park pose, and the walk that ships. All of it is simulation."""

import dataclasses
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import footfall
from conftest import ROOT

pytest.importorskip("mujoco")
pytest.importorskip("cma")
body: Any = pytest.importorskip("footfall.body")
from footfall.body.plane import FAST_M_S, TORQUE_SHARE, Plane, Trial, cost, search, tried, with_park  # noqa: E402
from footfall.body.rollouts import Outcome, Ride, outcomes  # noqa: E402

WALKS = ROOT / "python" / "walks"
ROBOT = (ROOT / "samples" / "robot.toml").read_text(encoding="utf-8")


def test_the_pulses_of_one_call_are_those_of_the_run() -> None:
    generator = footfall.Generator.read(WALKS / "desk-boom.toml")
    for robot in (None, ROOT / "samples" / "robot.toml"):
        driver = body.LoopDriver(generator, robot=robot)
        trace = body.run(body.Body(body.DESK, "boom", robot_file=robot), driver, 3.0)
        pulses = body.LoopDriver.pulses(generator, 3.0, robot=robot)
        assert np.array_equal([frame.us for frame in pulses.frames], trace.pulses_us)
        assert [frame.time_s for frame in pulses.frames] == pytest.approx(0.02 * np.arange(150))
        # The run has one more control period at its end.
        assert pulses.limited_share == pytest.approx(driver.limited_share, abs=0.002)


@pytest.mark.parametrize("trim_deg,push_ns", [((5.0, -4.0, 6.0, -3.0), 0.0), ((0.0, 0.0, 0.0, 0.0), -2.0)])
def test_a_quick_run_goes_as_far_as_an_exact_one(trim_deg: Any, push_ns: float) -> None:
    generator = footfall.Generator.read(WALKS / "desk-boom.toml")
    varied = dataclasses.replace(body.variation(2, "wide"), trim_deg=trim_deg)
    ours, plain = (body.Body(body.DESK, "boom", variation=one) for one in (varied, body.variation(2, "wide")))
    frames = body.LoopDriver.pulses(generator, 6.0).frames
    quick, other = outcomes([Ride(ours, frames, push_ns), Ride(plain, frames)], 6.0)
    trace = body.run(ours, body.LoopDriver(generator), 6.0, seed=2, push_ns=push_ns)
    found = body.measures(trace, False)
    assert quick.metres == pytest.approx(found["metres"], rel=0.003) and not quick.fallen and quick.seconds == 6.0
    assert abs(quick.metres - other.metres) > 0.007 * other.metres, "trim and push act"
    assert quick.torque_share == pytest.approx(max(found["motor_rms_nm"]) / ours.servos[0].servo.stall_nm, rel=0.05)


def test_a_quick_run_falls_when_an_exact_one_does() -> None:
    generator = footfall.Generator.default()
    ours = body.Body(body.DESK, "free", variation=body.variation(3))
    quick, held = outcomes([Ride(ours, body.LoopDriver.pulses(generator, 3.0).frames, 0.0, nm) for nm in (0.0, 50.0)], 3.0)
    trace = body.run(ours, body.LoopDriver(generator), 3.0, seed=3, until=body.fallen)
    assert quick.fallen and quick.seconds == pytest.approx(trace.time_s[-1], abs=0.03)
    assert not held.fallen and held.metres > 0.3


def test_a_quick_run_needs_a_supply() -> None:
    frames = body.LoopDriver.pulses(footfall.Generator.default(), 1.0).frames
    with pytest.raises(footfall.InputError, match="allowed"):
        outcomes([Ride(body.Body(body.DESK, "boom", supply_v=0.0), frames)], 1.0)


def test_the_park_pose_of_a_robot_file_is_changed_and_nothing_else(tmp_path: Path) -> None:
    text = with_park(ROBOT, (10.0, -12.5, 20.0, 5.25))
    (tmp_path / "robot.toml").write_text(text, encoding="utf-8")
    joints, before = footfall.robot(tmp_path / "robot.toml"), footfall.robot(ROOT / "samples" / "robot.toml")
    assert np.degrees([joints[joint]["park_rad"] for joint in footfall.JOINTS]) == pytest.approx([10.0, -12.5, 20.0, 5.25])
    for joint in footfall.JOINTS:
        assert {**joints[joint], "park_rad": 0.0} == {**before[joint], "park_rad": 0.0}
    with pytest.raises(footfall.InputError, match="allowed"):
        with_park(ROBOT.replace("park_deg = ", "part_deg = ", 1), (0.0, 0.0, 0.0, 0.0))


def test_what_a_run_costs() -> None:
    assert cost(Outcome(3.0, 10.0, False, TORQUE_SHARE), 10.0) == pytest.approx(-0.3)
    assert cost(Outcome(9.0, 10.0, False, TORQUE_SHARE), 10.0) == -FAST_M_S
    assert cost(Outcome(3.0, 10.0, False, TORQUE_SHARE + 0.1), 10.0) == pytest.approx(-0.2)
    # Standing is better than falling, and an early fall is the worst.
    assert cost(Outcome(0.0, 10.0, False, 0.0), 10.0) == 0.0 < cost(Outcome(4.0, 9.9, True, 0.0), 10.0) < cost(Outcome(0.5, 1.0, True, 0.0), 10.0)


def test_a_search_with_a_spring_finds_a_better_gait_and_finds_it_again() -> None:
    plane = Plane("desk", "standard", 3.0, with_park(ROBOT, (12.0, -12.0, 10.0, 10.0)), hold_nm=6.0)
    start = body.Gait.of(footfall.Generator.gait("natural-walk"))
    weak = body.Gait(start.stride_s, start.hip_deg / 3.0, start.knee_deg / 3.0)
    how: Any = {"generations": 4, "seeds": 1, "candidates": 6, "random": 3, "step": 1.0, "progress": False}
    found = search(plane, weak, jobs=2, **how)
    trials = [Trial(seed, "standard", 6.0) for seed in (1, 2)]
    before, _ = tried(plane, np.concatenate([weak.vector(), [12.0, -12.0, 10.0, 10.0]]), trials)
    park = [np.degrees(joint["park_rad"]) for joint in _maps(found.robot_text).values()]
    after, _ = tried(plane, np.concatenate([found.gait.vector(), park]), trials)
    mean = [float(np.mean([cost(one, 3.0) for one in many])) for many in (before, after)]
    assert mean[1] < mean[0] - 0.02 and found.runs > 20 and found.hold_nm > 0.0
    assert np.array_equal(search(plane, weak, jobs=1, **how).gait.vector(), found.gait.vector()), "however many processes"


def _maps(text: str) -> Any:
    """The joints of a robot file."""
    from tempfile import TemporaryDirectory

    with TemporaryDirectory() as folder:
        (Path(folder) / "robot.toml").write_text(text, encoding="utf-8")
        return footfall.robot(Path(folder) / "robot.toml")


def test_the_command_writes_a_gait_and_a_robot_file_that_walk(tmp_path: Path) -> None:
    """From the walk that ships, without a spring, with steps so small that the result is that walk."""
    files = "--gait", str(FREE), "--robot-file", str(FREE_ROBOT), "-o", str(tmp_path / "walk.toml"), "--robot-output", str(tmp_path / "robot.toml")
    few = "--hold 0 --secs 5.5 --generations 1 --candidates 4 --seeds 1 --jobs 1 --step 0.01 --push 0.1 --slope 0.5 --kind wide".split()
    command = [sys.executable, "-m", "footfall.body", "search", "--rig", "free", *files, *few]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert "accepted, walks" in done.stdout and re.search("[01] of 8 fall", done.stdout) and "generation 1 of 1" in done.stderr
    found = body.Gait.of(footfall.Generator.read(tmp_path / "walk.toml"))
    assert found.vector() == pytest.approx(body.Gait.of(footfall.Generator.read(FREE)).vector(), abs=0.3)
    text = (tmp_path / "robot.toml").read_text(encoding="utf-8")
    for joint, one in _maps(FREE_ROBOT.read_text(encoding="utf-8")).items():
        assert _maps(text)[joint]["park_rad"] == pytest.approx(one["park_rad"], abs=0.01) and text.startswith("# The robot of desk-free.toml")
    assert "pushes to 0.1 N s, slopes to 0.5 deg" in (tmp_path / "walk.toml").read_text(encoding="utf-8")


def test_a_search_that_still_needs_its_spring_is_no_walk(tmp_path: Path) -> None:
    files = "--gait", str(FREE), "--robot-file", str(FREE_ROBOT), "-o", str(tmp_path / "walk.toml"), "--robot-output", str(tmp_path / "robot.toml")
    few = "--hold 6 --secs 1 --generations 1 --candidates 4 --seeds 1 --jobs 1 --step 0.01".split()
    command = [sys.executable, "-m", "footfall.body", "search", "--rig", "free", *files, *few]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=ROOT)
    assert done.returncode == 1 and "still holds the lean" in done.stdout, done.stderr


def test_a_launch_may_be_later() -> None:
    generator = footfall.Generator.read(FREE)
    first, later = (body.LoopDriver.pulses(generator, 4.0, robot=FREE_ROBOT, later_ms=later_ms) for later_ms in (0, 100))
    # After the ramp of 2 s the pattern is that of 0.1 s later, which is five servo frames.
    assert [frame.us for frame in later.frames[105:150]] == [frame.us for frame in first.frames[110:155]]
    assert [frame.us for frame in later.frames[:100]] != [frame.us for frame in first.frames[:100]]
    with pytest.raises(footfall.InputError, match="allowed"):
        body.LoopDriver.pulses(generator, 4.0, later_ms=-1)


#: The walk that ships, and its robot file.
FREE, FREE_ROBOT = WALKS / "desk-free.toml", WALKS / "desk-free-robot.toml"


def test_the_walk_that_ships_walks_free_in_the_plane() -> None:
    """The bounds of docs/body.md on a few of its seeds, by quick runs; the first one by an exact run too."""
    generator = footfall.Generator.read(FREE)
    certificate = footfall.certify(generator, robot=FREE_ROBOT)
    assert certificate.status == "accepted" and certificate.walks
    pulses = body.LoopDriver.pulses(generator, 10.0, robot=FREE_ROBOT)
    assert pulses.limited_share == 0.0, "inside the limits"

    def ride(seed: int, kind: str, push_ns: float = 0.0, slope_deg: float = 0.0) -> Ride:
        varied = body.variation(seed, kind)
        varied = dataclasses.replace(varied, slope_deg=varied.slope_deg + slope_deg)
        return Ride(body.Body(body.DESK, "free", variation=varied, robot_file=FREE_ROBOT), pulses.frames, push_ns)

    plain = outcomes([ride(seed, kind) for kind in ("standard", "wide") for seed in (1, 2, 3, 4)], 10.0)
    assert not any(one.fallen for one in plain) and min(one.metres for one in plain[:4]) > 4.2
    pushed = outcomes([ride(1, "standard", push_ns) for push_ns in (0.15, -0.15)], 10.0)
    assert not any(one.fallen for one in pushed) and min(one.metres for one in pushed) > 4.0
    sloped = outcomes([ride(1, "standard", 0.0, slope_deg) for slope_deg in (1.0, -1.0)], 10.0)
    assert not any(one.fallen for one in sloped) and min(one.metres for one in sloped) > 3.5
    ours = ride(1, "standard").body
    trace = body.run(ours, body.LoopDriver(generator, robot=FREE_ROBOT), 10.0, seed=1, until=body.fallen)
    assert not body.fallen(ours) and trace.trunk[-1, 0] == pytest.approx(plain[0].metres, rel=0.02)

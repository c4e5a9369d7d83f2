"""The search for a gait: gaits as numbers, what a run costs, and that a search finds a better gait than it began with. All of it is simulation."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Dict, List, Tuple

import numpy as np
import pytest

import footfall
from conftest import ROOT

pytest.importorskip("mujoco")
pytest.importorskip("cma")
body = pytest.importorskip("footfall.body")
from footfall.body.search import FIRST_SEED, SLIP_M_S, TORQUE_SHARE, cost, tried  # noqa: E402

BOOM = body.Task("desk", "boom", "standard", 1.5)


def test_the_gait_of_a_generator_file_has_its_numbers() -> None:
    generator = footfall.Generator.read(ROOT / "samples" / "generator.toml")
    gait = body.Gait.of(generator)
    assert gait.stride_s == pytest.approx(1.0909)
    # Those of the file, up to the harmonics that a gait has.
    assert gait.hip_deg == pytest.approx([9.364, 17.916, 0.677, 13.364, -4.461], abs=0.002)
    assert gait.knee_deg == pytest.approx([27.584, 14.062, -7.951, -2.399, -15.453, -16.586, -4.304], abs=0.002)
    again = body.Gait.of(gait.generator())
    assert again.vector() == pytest.approx(gait.vector(), abs=0.002)
    assert np.array_equal(body.Gait.of_vector(gait.vector()).vector(), gait.vector())


def test_the_right_leg_is_half_a_stride_later() -> None:
    gait = body.Gait(1.0, np.array([5.0, 10.0, 3.0, -7.0, 2.0]), np.array([30.0, 9.0, -4.0, 2.0, -8.0, 5.0, 1.0]))
    angles = gait.generator().run(2.0).angles_rad
    np.testing.assert_allclose(angles[500:1500, 1], angles[:1000, 0], atol=1e-4)
    np.testing.assert_allclose(angles[500:1500, 3], angles[:1000, 2], atol=1e-4)
    assert np.ptp(angles[:, 0]) > 0.3 and np.ptp(angles[:, 2]) > 0.3


def test_what_a_run_costs() -> None:
    good: Dict[str, Any] = {"metres": 3.0, "torque_share": TORQUE_SHARE, "slip_m": 6.0 * SLIP_M_S, "limited_share": 0.0, "fallen": False, "seconds": 6.0}

    def of(**changes: Any) -> float:
        return cost({**good, **changes}, 6.0)

    assert of() == -0.5 and of(metres=0.0) == 0.0
    assert of(torque_share=TORQUE_SHARE + 0.1) == pytest.approx(-0.2)
    assert of(slip_m=6.0 * (SLIP_M_S + 0.01)) == pytest.approx(-0.4)
    assert of(limited_share=0.2) == pytest.approx(-0.1)
    # A fall costs more than any walk earns, and an early one more than a late one.
    assert of(fallen=True) == 0.5 and of(fallen=True, seconds=3.0) == 1.5


def test_a_search_that_is_stopped_at_its_very_end_keeps_its_gait(monkeypatch: pytest.MonkeyPatch) -> None:
    class Stopped:
        """Runs in this process; the keyboard's signal comes after the last result."""

        def __init__(self, jobs: int) -> None:
            self.each = lambda function, work, chunksize=1: [0.0 for _ in work]

        def __enter__(self) -> "Stopped":
            return self

        def __exit__(self, *_: object) -> None:
            raise KeyboardInterrupt

    # `footfall.body.search` is also the function.
    monkeypatch.setattr(sys.modules["footfall.body.search"], "Processes", Stopped)
    start = body.Gait.of(footfall.Generator.gait("natural-walk"))
    found = body.search(BOOM, start, generations=2, seeds=1, candidates=4, random=1, step=1.0, jobs=1, progress=False)
    assert found.was_stopped and found.generations == 2


def test_a_search_finds_a_better_gait_and_finds_it_again() -> None:
    start = body.Gait.of(footfall.Generator.gait("natural-walk"))
    # The shuffle of a gait with a third of its amplitudes.
    weak = body.Gait(start.stride_s, start.hip_deg / 3.0, start.knee_deg / 3.0)
    how = {"generations": 5, "seeds": 1, "candidates": 6, "random": 3, "step": 1.0, "progress": False}
    found = body.search(BOOM, weak, jobs=2, **how)
    others = range(1, 5)
    before, after = (np.mean([tried(BOOM, gait.vector(), seed)["cost"] for seed in others]) for gait in (weak, found.gait))
    assert after < before - 0.02 and found.runs > 40
    assert np.array_equal(body.search(BOOM, weak, jobs=1, **how).gait.vector(), found.gait.vector()), "however many processes"
    assert FIRST_SEED > 10_000, "the seeds of `--seeds` are not those of the search"


def test_the_gait_that_ships_walks_far_with_little_torque_and_slip() -> None:
    generator = footfall.Generator.read(ROOT / "python" / "walks" / "desk-boom.toml")
    certificate = footfall.certify(generator)
    assert certificate.status == "accepted" and certificate.walks
    task = body.Task("desk", "boom", "standard", 10.0)
    for seed in (1, 2, 3):
        one = tried(task, body.Gait.of(generator).vector(), seed)
        # The bounds of docs/body.md.
        assert one["metres"] > 5.5 and not one["fallen"] and one["torque_share"] < 0.38 and one["slip_m"] < 0.11, one


def run(*arguments: object) -> Tuple[int, str, str]:
    """Exit code, output and messages."""
    command: List[str] = [sys.executable, "-m", "footfall.body", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=ROOT)
    return done.returncode, done.stdout, done.stderr


def test_the_command_writes_a_generator_file_that_walks(tmp_path: Path) -> None:
    gait = tmp_path / "walk.toml"
    few = ("--secs", 1, "--generations", 1, "--candidates", 4, "--seeds", 1, "--jobs", 1, "--step", 0.01)
    code, output, messages = run("search", "--gait", "natural-walk", *few, "-o", gait)
    assert code == 0, messages
    assert "accepted, walks" in output and "simulation" in output and "generation 1 of 1" in messages
    generator = footfall.Generator.read(gait)
    assert generator.kind == "shape" and "natural-walk" in gait.read_text(encoding="utf-8"), "the file says how it was found"
    # A step so small that it is the gait from which the search began.
    assert body.Gait.of(generator).hip_deg == pytest.approx(body.Gait.of(footfall.Generator.gait("natural-walk")).hip_deg, abs=0.3)


def test_processes_of_a_search_that_is_killed_end(tmp_path: Path) -> None:
    if not Path("/proc/self/stat").exists():
        pytest.skip("no /proc to find processes in")
    marker = f"marker-{time.time_ns()}"
    command = [sys.executable, "-m", "footfall.body", "search", "--secs", "1", "--candidates", "4", "--seeds", "1", "--jobs", "2"]
    environment = {**os.environ, "FOOTFALL_TEST_MARKER": marker}

    def left() -> List[str]:
        found = []
        for name in Path("/proc").glob("[0-9]*/environ"):
            try:
                has_it = marker.encode() in name.read_bytes()
                # The name stands in brackets; then the state: `Z` has ended.
                state = name.with_name("stat").read_text().rsplit(")", 1)[1].split()[0]
            except OSError:
                continue
            if has_it and state != "Z":
                found.append(name.parent.name)
        return found

    search = subprocess.Popen([*command, "-o", str(tmp_path / "walk.toml")], stderr=subprocess.PIPE, env=environment, cwd=ROOT)
    assert search.stderr is not None
    assert b"generation 1" in search.stderr.readline() and len(left()) >= 3
    search.send_signal(signal.SIGKILL)
    search.wait()
    # Not to its end: a process that was left over would keep it open.
    search.stderr.close()
    until = time.monotonic() + 30.0
    while left() and time.monotonic() < until:
        time.sleep(0.1)
    assert left() == []


@pytest.mark.parametrize(
    "arguments,words",
    [
        (["search"], "-o FILE"),
        (["search", "-o", "walk.toml", "--json"], "--json"),
        (["search", "-o", "walk.toml", "--candidates", "3"], "allowed is a whole number from 4"),
        (["search", "-o", "walk.toml", "--robot", "person"], "size"),
        (["--generations", "5"], "--generations: allowed with `search`"),
        (["-o", "walk.toml"], "--output: allowed with `search`"),
    ],
)
def test_wrong_input_is_exit_code_2_and_says_what_is_allowed(arguments: List[str], words: str) -> None:
    code, output, messages = run(*arguments)
    assert code == 2 and output == "" and words in messages and "Traceback" not in messages, messages
    assert not (ROOT / "walk.toml").exists()


def test_without_cma_it_says_what_to_install(tmp_path: Path) -> None:
    (tmp_path / "cma.py").write_text("raise ImportError('not here')\n")
    line = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); from footfall.body.cli import main; sys.exit(main(sys.argv[1:]))"
    command = [sys.executable, "-c", line, "search", "-o", str(tmp_path / "walk.toml")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 1 and "footfall[body]" in done.stderr and "Traceback" not in done.stderr


def test_the_versions_of_cma_agree() -> None:
    from footfall.body._extra import CMA

    for name in ("python/pyproject.toml", "python/tests/requirements.txt"):
        assert f"cma=={CMA}" in (ROOT / name).read_text(encoding="utf-8"), name

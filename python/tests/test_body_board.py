"""A body that the flashed image drives on the virtual board, and one that the control loop in this process drives: the same pulses.

``FOOTFALL_ELF``, ``FOOTFALL_VIRTUAL_BOARD`` and ``FOOTFALL_BIN`` name the image and the programs; ``cargo xtask test`` sets them.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import footfall
from conftest import ROOT

NEEDED = ("FOOTFALL_ELF", "FOOTFALL_VIRTUAL_BOARD", "FOOTFALL_BIN")

pytestmark = pytest.mark.skipif(
    any(name not in os.environ for name in NEEDED), reason="no image and virtual board; the step python-board has them"
)
pytest.importorskip("mujoco")
body: Any = pytest.importorskip("footfall.body")


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The robot record of the default robot."""
    folder = tmp_path_factory.mktemp("record")
    text = subprocess.run([os.environ["FOOTFALL_BIN"], "defaults", "robot"], capture_output=True, check=True).stdout
    (folder / "robot.toml").write_bytes(text)
    command = [os.environ["FOOTFALL_BIN"], "pack", "--robot", str(folder / "robot.toml"), "-o", str(folder / "robot.bin")]
    subprocess.run(command, capture_output=True, check=True)
    return folder / "robot.bin"


def test_both_drivers_give_the_same_pulses(record: Path) -> None:
    one = body.Body(body.DESK, "boom")
    with body.BoardDriver(os.environ["FOOTFALL_ELF"], robot=record) as driver:
        board = body.run(one, driver, 2.0)
    loop = body.run(body.Body(body.DESK, "boom"), body.LoopDriver(), 2.0)
    count = min(len(board.pulses_us), len(loop.pulses_us))
    assert count >= 99
    np.testing.assert_allclose(board.pulses_us[:count], loop.pulses_us[:count], atol=0.0)
    assert float(np.ptp(board.pulses_us[:, 0])) > 100.0, "it walks"
    np.testing.assert_allclose(board.trunk[-1], loop.trunk[-1], atol=0.02)


def test_the_image_walks_the_gait_that_a_search_found(record: Path, tmp_path: Path) -> None:
    gait, packed = ROOT / "python" / "walks" / "desk-boom.toml", tmp_path / "generator.bin"
    subprocess.run([os.environ["FOOTFALL_BIN"], "pack", str(gait), "-o", str(packed)], capture_output=True, check=True)
    with body.BoardDriver(os.environ["FOOTFALL_ELF"], robot=record, generator=packed) as driver:
        board = body.run(body.Body(body.DESK, "boom"), driver, 5.0, until=body.fallen)
    loop = body.run(body.Body(body.DESK, "boom"), body.LoopDriver(footfall.Generator.read(gait)), 5.0, until=body.fallen)
    count = min(len(board.pulses_us), len(loop.pulses_us))
    assert count >= 249
    np.testing.assert_allclose(board.pulses_us[:count], loop.pulses_us[:count], atol=0.0)
    assert board.trunk[-1, 0] > WAY_M, "it walks"


def test_the_image_walks_free_in_the_plane(tmp_path: Path) -> None:
    walks = ROOT / "python" / "walks"
    gait, robot = walks / "desk-free.toml", walks / "desk-free-robot.toml"
    for command in (["pack", str(gait), "-o", str(tmp_path / "g.bin")], ["pack", "--robot", str(robot), "-o", str(tmp_path / "r.bin")]):
        subprocess.run([os.environ["FOOTFALL_BIN"], *command], capture_output=True, check=True)
    one = body.Body(body.DESK, "free", robot_file=robot)
    with body.BoardDriver(os.environ["FOOTFALL_ELF"], robot=tmp_path / "r.bin", generator=tmp_path / "g.bin") as driver:
        board = body.run(one, driver, 5.0, until=body.fallen)
    same = body.LoopDriver(footfall.Generator.read(gait), robot=robot)
    loop = body.run(body.Body(body.DESK, "free", robot_file=robot), same, 5.0, until=body.fallen)
    count = min(len(board.pulses_us), len(loop.pulses_us))
    assert count >= 249
    np.testing.assert_allclose(board.pulses_us[:count], loop.pulses_us[:count], atol=0.0)
    assert not body.fallen(one) and board.trunk[-1, 0] > FREE_WAY_M, "it walks"


#: Way of the walk in the plane in 5 s, m: the ramp of 2 s is in it.
FREE_WAY_M = 1.2


#: Way of the walk on the boom in 5 s, of docs/body.md, m.
WAY_M = 2.5


def test_the_command_line_takes_an_image(record: Path) -> None:
    arguments = ["--elf", os.environ["FOOTFALL_ELF"], "--robot-record", str(record), "--secs", "1", "--json", "--quiet"]
    done = subprocess.run([sys.executable, "-m", "footfall.body", *arguments], capture_output=True, text=True, timeout=300, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["all"]["runs"] == 1

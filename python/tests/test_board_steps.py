"""The flashed image on the virtual board, stepped from Python: gestures, pulses, a supply that drops, the example, the block of the page.

``FOOTFALL_ELF``, ``FOOTFALL_VIRTUAL_BOARD`` and ``FOOTFALL_BIN`` name the image and the programs; ``cargo xtask test`` sets them.
"""

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Dict

import numpy as np
import pytest

import footfall
from conftest import ROOT

NEEDED = ("FOOTFALL_ELF", "FOOTFALL_VIRTUAL_BOARD", "FOOTFALL_BIN")

pytestmark = pytest.mark.skipif(
    any(name not in os.environ for name in NEEDED), reason="no image and virtual board; the step python-board has them"
)


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Dict[str, Path]:
    """Flash records and the sensor file, as the program `footfall` writes them."""
    folder, program = tmp_path_factory.mktemp("records"), os.environ["FOOTFALL_BIN"]
    made = {name: folder / f"{name}.bin" for name in ("robot", "follower", "sensors")}
    for name in ("robot", "sensor"):
        made[f"{name}.toml"] = folder / f"{name}.toml"
        text = subprocess.run([program, "defaults", name], capture_output=True, text=True, check=True).stdout
        made[f"{name}.toml"].write_text(text)
    sources = {
        "robot": ["--robot", made["robot.toml"]],
        "follower": [ROOT / "samples" / "follower.toml"],
        "sensors": ["--sensor", f"left_hip={made['sensor.toml']}"],
    }
    for name, source in sources.items():
        subprocess.run([program, "pack", *map(str, source), "-o", str(made[name])], check=True, capture_output=True)
    return made


def person(time_s: float) -> "list[float]":
    """Volts of a goniometer that swings."""
    return [1.5 + 0.3 * np.sin(2.0 * np.pi * time_s / 1.1)]


def walk(board: footfall.VirtualBoard, until_s: float) -> "list[footfall.Step]":
    steps = []
    while board.time_s < until_s:
        steps.append(board.step(0.005, person(board.time_s)))
    return steps


def test_a_board_that_is_armed_walks_inside_the_ranges(files: Dict[str, Path]) -> None:
    with footfall.VirtualBoard(os.environ["FOOTFALL_ELF"], robot=files["robot"], servo="digital", servo_at_deg=[0, 0, 5, 5]) as board:
        boots = board.step(0.001, person(0.0)).boots
        armed = board.arm(lambda step: person(step.time_s))
        steps = walk(board, 6.0)
        widths = np.vstack([step.pulses.us for step in steps])
        angles = np.degrees(board.joint_angles(widths))
    assert boots == [footfall.Boot(0.0, "power_on")] and 0.7 < armed.time_s < 0.8
    assert len(widths) > 240 and not np.isnan(widths).any()
    least, most = angles.min(axis=0), angles.max(axis=0)
    assert (least >= [-30, -30, -2, -2]).all() and (most <= [60, 60, 120, 120]).all() and (most - least > 20).all()
    turned = np.degrees(np.array([step.servo_rad for step in steps]))
    assert (np.abs(turned.max(axis=0) - most) < 6.0).all()
    verdict = board.verdict
    assert verdict is not None and verdict.good and verdict.violations == 0 and verdict.pulses >= 4 * len(widths)


def test_two_equal_runs_are_equal(files: Dict[str, Path]) -> None:
    runs = []
    for _ in range(2):
        with footfall.VirtualBoard(os.environ["FOOTFALL_ELF"], robot=files["robot"]) as board:
            board.arm(lambda step: person(step.time_s), step_s=0.005)
            steps = walk(board, 2.5)
        runs.append((b"".join(step.log for step in steps), np.vstack([step.pulses.us for step in steps]).tolist(), board.verdict))
    assert runs[0] == runs[1] and len(runs[0][0]) > 10_000


def test_the_supply_the_stop_and_the_lamps(files: Dict[str, Path]) -> None:
    with footfall.VirtualBoard(os.environ["FOOTFALL_ELF"], robot=files["robot"]) as board:
        board.arm(lambda step: person(step.time_s), step_s=0.005)
        walk(board, 2.0)
        pressed = board.step(0.001, stop=True)
        assert not pressed.rail and not pressed.armed
        board.step(0.2, stop=False)
        dropped = board.step(0.01, {"VDD": 2.4})
        assert [boot.cause for boot in dropped.boots] == ["brown_out"]
        lamps = [board.step(0.1, {"VDD": 3.0}).lamps for _ in range(20)]
    assert any(lamps) and all(set(lamp) <= {"PD12", "PD13", "PD14", "PD15"} for lamp in lamps)


def test_a_wrong_step_and_a_wrong_option_are_errors(files: Dict[str, Path]) -> None:
    elf = os.environ["FOOTFALL_ELF"]
    with footfall.VirtualBoard(elf) as board:
        with pytest.raises(footfall.InputError, match="PE9 is not a pin of a converter"):
            board.step(0.001, {"PE9": 1.0})
        with pytest.raises(footfall.InputError, match="1 to 10000000, microseconds"):
            board.step(11.0)
        # Without a robot record the board runs the built-in robot.
        assert len(board.joint_angles([1500.0] * 4)) == 4
        assert board.step(0.001).time_s == 0.001
    with pytest.raises(footfall.BoardError, match="cannot be used with"):
        footfall.VirtualBoard(elf, options=["--pace"])


def test_the_example_follows_the_leg(files: Dict[str, Path], tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    picture = tmp_path / "leg.png"
    example = ROOT / "python" / "examples" / "leg.py"
    names = [files["robot"], files["follower"], files["sensors"], files["sensor.toml"], picture]
    command = [sys.executable, str(example), os.environ["FOOTFALL_ELF"], *map(str, names)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    numbers = [[float(number) for number in re.findall(r"\d+(?:\.\d+)?", line)] for line in done.stdout.splitlines()]
    (armed_s,), (_, swing, from_alone), (from_hip,), (pulses, violations) = numbers
    assert 0.7 < armed_s < 0.8 and violations == 0 and pulses > 1500
    # What the board does moves the leg that it measures.
    assert swing > 30.0 and from_hip < 8.0 and from_alone > 1.0
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_the_block_of_the_page_runs(files: Dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (ROOT / "docs" / "virtual-board.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    (tmp_path / "firmware.elf").write_bytes(Path(os.environ["FOOTFALL_ELF"]).read_bytes())
    (tmp_path / "robot.bin").write_bytes(files["robot"].read_bytes())
    monkeypatch.chdir(tmp_path)
    exec(compile(block, "docs/virtual-board.md", "exec"), {})

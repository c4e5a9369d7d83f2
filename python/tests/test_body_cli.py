"""The command line ``python -m footfall.body``: what it prints, its exit codes, its errors."""

import json
import struct
import subprocess
import sys
from pathlib import Path
from typing import List, Tuple

import pytest

from conftest import ROOT

pytest.importorskip("mujoco")
pytest.importorskip("matplotlib")


def run(*arguments: object) -> Tuple[int, str, str]:
    """Exit code, output and messages."""
    command: List[str] = [sys.executable, "-m", "footfall.body", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=ROOT)
    return done.returncode, done.stdout, done.stderr


def test_it_walks_with_a_generator_file_and_draws_a_picture(tmp_path: Path) -> None:
    picture = tmp_path / "walk.png"
    code, output, messages = run("--rig", "boom", "--secs", 2, "--gait", "samples/generator.toml", "--seeds", 2, "--json", "--picture", picture)
    assert code == 0, messages
    found = json.loads(output)
    assert found["simulation"] and [one["seed"] for one in found["each"]] == [1, 2] and found["all"]["runs"] == 2
    assert found["all"]["metres_mean"] == pytest.approx(sum(one["metres"] for one in found["each"]) / 2)
    assert found["each"][0]["metres"] != found["each"][1]["metres"], "seeds differ"
    assert messages.count("run ") == 2, "progress"
    data = picture.read_bytes()
    assert data.startswith(b"\x89PNG") and struct.unpack(">II", data[16:24]) == (1400, 360)


def test_a_gait_by_its_name_walks_three_metres() -> None:
    code, output, messages = run("--gait", "natural-walk", "--seeds", 3, "--json")
    assert code == 0, messages
    found = json.loads(output)["all"]
    assert found["metres_least"] > 3.0 and found["falls"] == 0 and found["slip_share_mean"] * found["metres_mean"] < 0.1
    code, _, messages = run("--gait", "natural-wlak")
    assert code == 2 and "natural-wlak" in messages


def test_the_table_has_every_joint_and_says_that_it_is_a_simulation() -> None:
    code, output, messages = run("--rig", "hung", "--secs", 1, "--robot", "mini", "--quiet")
    assert code == 0 and messages == ""
    assert "simulation" in output and all(joint in output for joint in ("left_hip", "right_hip", "left_knee", "right_knee"))


def test_the_size_of_a_person_s_drive_is_that_of_the_motion() -> None:
    code, output, _ = run("size", "--robot", "person", "--secs", 2, "--json")
    rows = json.loads(output)["joints"]
    assert code == 0 and len(rows) == 4
    for row in rows:
        assert 0.0 < row["torque_95_nm"] <= row["torque_100_nm"] and 0.0 < row["speed_95_deg_s"] <= row["speed_100_deg_s"]
    # The thigh with its leg weighs 11.3 kg: its moment about the hip at the walk's 25.8 degrees is some 17 N m with the knee straight.
    assert 10.0 < rows[0]["torque_100_nm"] < 60.0


@pytest.mark.parametrize(
    "arguments,words",
    [
        (["--rig", "rail"], "hung"),
        (["--secs", "0"], "allowed is 1 to 600 s"),
        (["--seeds", "0"], "allowed is a whole number"),
        (["--gait", "missing.toml"], "missing.toml"),
        (["--gait", "samples/rows.csv"], "rows.csv"),
        (["--supply", "12"], "allowed is 4.8 to 6 V"),
        (["--robot", "person"], "size"),
        (["--picture", "no/folder/walk.png"], "folder"),
        (["--push", "0.1", "--secs", "5"], "at 5 s"),
        (["--slope", "30"], "allowed is -10 to 10 deg"),
        (["size", "--picture", "walk.png"], "walk"),
    ],
)
def test_wrong_input_is_exit_code_2_and_says_what_is_allowed(arguments: List[str], words: str) -> None:
    code, output, messages = run(*arguments)
    assert code == 2 and output == "" and words in messages and "Traceback" not in messages, messages


def test_a_floor_that_rises_is_harder_to_walk() -> None:
    ways = [json.loads(run("--secs", 4, "--slope", slope, "--json", "--quiet")[1])["all"]["metres_mean"] for slope in (-4, 4)]
    assert ways[1] < ways[0] - 0.04


def test_a_servo_without_supply_is_a_fall_not_an_error() -> None:
    code, output, _ = run("--secs", 2, "--supply", 0, "--json")
    assert code == 0 and json.loads(output)["all"]["falls"] == 1


def test_a_reader_that_goes_is_no_error() -> None:
    command = [sys.executable, "-m", "footfall.body", "--rig", "hung", "--secs", "1", "--quiet"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=ROOT) as process:
        assert process.stdout is not None and process.stderr is not None
        process.stdout.close()
        assert process.stderr.read() == b"" and process.wait(60) == 0


def test_without_mujoco_it_says_what_to_install(tmp_path: Path) -> None:
    (tmp_path / "mujoco.py").write_text("raise ImportError('not here')\n")
    command = [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(tmp_path)!r}); from footfall.body.cli import main; sys.exit(main([]))"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 1 and "footfall[body]" in done.stderr and "Traceback" not in done.stderr


def test_the_versions_of_mujoco_agree() -> None:
    from footfall.body._extra import MUJOCO

    for name in ("python/pyproject.toml", "python/tests/requirements.txt"):
        assert f"mujoco=={MUJOCO}" in (ROOT / name).read_text(encoding="utf-8"), name

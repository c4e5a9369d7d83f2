"""The command line ``python -m footfall.body``: what it prints, its exit codes, its errors."""

import argparse
import json
import math
import re
import shutil
import struct
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any, List, Tuple

import pytest

from conftest import ROOT

pytest.importorskip("mujoco")
pytest.importorskip("matplotlib")

from footfall import InputError, certify  # noqa: E402
from footfall.body import DESK, Robot, body_file, cli, person, picture  # noqa: E402
from footfall.body.by_name import named_generator  # noqa: E402
from footfall.body.runs import Runs, why_it_does_not_walk  # noqa: E402


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


def test_the_help_names_the_commands() -> None:
    code, output, _ = run("--help")
    assert code == 0 and all(f"footfall.body {name}" in output for name in ("size", "worn", "report", "search", "feedback"))


def test_the_table_has_every_joint_and_says_that_it_is_a_simulation() -> None:
    code, output, messages = run("--rig", "hung", "--secs", 1, "--robot", "mini", "--quiet")
    assert code == 0 and messages == ""
    assert "simulation" in output and all(joint in output for joint in ("left_hip", "right_hip", "left_knee", "right_knee"))


def test_the_size_of_a_person_s_drive_is_that_of_the_motion() -> None:
    code, output, _ = run("size", "--robot", "person", "--secs", 2, "--json")
    (found,) = json.loads(output)["runs"]
    rows = found["joints"]
    # No hobby servo moves such a leg.
    assert [one["suffices"] for one in found["servos"]] == [False] * 3
    assert code == 0 and len(rows) == 4
    for row in rows:
        assert 0.0 < row["torque_95_nm"] <= row["torque_100_nm"] and 0.0 < row["speed_95_deg_s"] <= row["speed_100_deg_s"]
    # The thigh with its leg weighs 11.3 kg: its moment about the hip at the walk's 25.8 degrees is some 17 N m with the knee straight.
    assert 10.0 < rows[0]["torque_100_nm"] < 60.0


def test_the_size_of_several_gaits_and_speeds_has_a_line_a_joint_and_says_which_servo_is_enough() -> None:
    arguments = ["size", "--gait", "natural-walk", "--gait", "samples/generator.toml", "--speed", "0.8,1.2", "--secs", 3, "--json", "--quiet"]
    code, output, messages = run(*arguments)
    assert code == 0, messages
    found = json.loads(output)["runs"]
    assert [(one["gait"], one["speed"]) for one in found] == [
        (gait, speed) for gait in ("natural-walk", "samples/generator.toml") for speed in (0.8, 1.2)
    ]
    for slow, fast in ((found[0], found[1]), (found[2], found[3])):
        # The knees swing faster at a higher speed of the gait.
        assert fast["joints"][2]["speed_95_deg_s"] > 1.15 * slow["joints"][2]["speed_95_deg_s"]
        enough = {one["servo"]: one["suffices"] for one in slow["servos"]}
        assert enough == {"SG90": False, "MG996R": True, "DS3225": True}
    text = run(*arguments[:-2], "--quiet")[1]
    assert text.count("right_knee") == 4 and text.count("DS3225") == 4


def test_a_person_at_another_speed_needs_the_torque_of_the_square() -> None:
    slow, fast = (json.loads(run("size", "--robot", "person", "--secs", 2, "--speed", speed, "--json")[1])["runs"][0] for speed in (1, 1.2))
    for first, second in zip(slow["joints"], fast["joints"]):
        assert second["speed_100_deg_s"] == pytest.approx(1.2 * first["speed_100_deg_s"], rel=0.01)
        # Between gravity, which stays, and inertia, which grows with the square.
        assert 1.0 < second["torque_100_nm"] / first["torque_100_nm"] < 1.44 * 1.3


def test_a_robot_file_may_stand_where_a_body_does() -> None:
    ways = [json.loads(run("--secs", 2, *robot, "--json", "--quiet")[1])["all"]["metres_mean"] for robot in (["--robot", "samples/robot.toml"], ["--robot-file", "samples/robot.toml"])]
    assert ways[0] == ways[1]


def test_a_body_file_of_the_desk_robot_walks_as_the_desk_robot(tmp_path: Path) -> None:
    file = tmp_path / "body.toml"
    file.write_text(run("defaults")[1], encoding="utf-8")
    ours, named = (json.loads(run("--secs", 2, "--json", *options)[1])["each"] for options in (("--body", file), ()))
    assert ours == named


def test_legs_of_twice_the_mass_need_twice_the_torque(tmp_path: Path) -> None:
    def torque(robot: Robot) -> float:
        file = tmp_path / "body.toml"
        file.write_text(body_file.text_of(robot), encoding="utf-8")
        code, output, messages = run("size", "--body", file, "--secs", 2, "--json")
        assert code == 0, messages
        (found,) = json.loads(output)["runs"]
        return float(found["joints"][0]["torque_100_nm"])

    # Without a servo: legs that hang, whose inverse dynamics are linear in their masses.
    light = person()
    thigh, shank = (replace(part, mass_kg=2.0 * part.mass_kg) for part in (light.thigh, light.shank))
    heavy = replace(light, thigh=thigh, shank=shank, foot=replace(light.foot, mass_kg=2.0 * light.foot.mass_kg))
    assert torque(heavy) == pytest.approx(2.0 * torque(light), rel=1e-6)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("mass_kg = 0.14", "mass_kg = -1", "thigh.mass_kg = -1: allowed is 0.001 to 200"),
        ("mass_kg = 0.14", "mass_kg = true", "thigh.mass_kg = True: allowed is"),
        ("mass_kg = 0.14", "mass_kg = nan", "thigh.mass_kg = nan: allowed is"),
        ("com_m = 0.07", "com_m = 0.2", "thigh.com_m = 0.2: allowed is 0 to its length_m, 0.11"),
        ("com_m = 0.07", "con_m = 0.07", "[thigh] unknown key `con_m`: allowed are mass_kg, length_m, com_m, gyration_m"),
        ("com_m = 0.07\n", "", "[thigh] com_m missing"),
        ("length_m = 0.09", "length_m = 0.4", "foot.length_m = 0.4: allowed is half a circle at most, 0.314159 m"),
        ('servo = "MG996R"\n', "", "servo and supply_v go together"),
        ("MG996R\"", "MG995\"", "allowed is one of SG90, MG996R, DS3225"),
        ("supply_v = 6.0", "supply_v = 9.0", "supply of MG996R = 9 V: allowed is 4.8 to 6 V"),
        ("[trunk]", "[trunk", "(at line"),
        ('name = "desk"', "name = 3", "name = 3: allowed is a text"),
    ],
)
def test_a_wrong_body_file_names_what_is_allowed(tmp_path: Path, old: str, new: str, words: str) -> None:
    file = tmp_path / "body.toml"
    text = body_file.text_of(DESK)
    assert old in text
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError) as refused:
        body_file.read(str(file))
    assert words in str(refused.value) and str(file) in str(refused.value)


def test_a_run_is_a_video_of_true_time(tmp_path: Path) -> None:
    from PIL import Image

    code, _, messages = run("--secs", 1, "--gait", "python/walks/desk-boom.toml", "--picture", tmp_path / "walk.gif")
    assert code == 0, messages
    with Image.open(tmp_path / "walk.gif") as movie:
        # Equal pictures, as before the first step, are one that is shown for longer.
        shown_ms = 0
        for number in range(movie.n_frames):  # type: ignore[attr-defined]
            movie.seek(number)
            shown_ms += movie.info["duration"]
        assert shown_ms == 1000 and movie.n_frames > 10 and movie.size == (640, 480)  # type: ignore[attr-defined]


def test_an_mp4_without_ffmpeg_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    code, output, messages = run("--secs", 1, "--picture", tmp_path / "walk.mp4")
    assert code == 1 and output == "" and "ffmpeg" in messages and ".gif" in messages


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="no ffmpeg on the path, which writes an MP4")
def test_a_run_is_an_mp4(tmp_path: Path) -> None:
    code, _, messages = run("--secs", 1, "--picture", tmp_path / "walk.mp4")
    assert code == 0 and (tmp_path / "walk.mp4").read_bytes()[4:8] == b"ftyp", messages


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
        (["--push", "0.1", "--secs", "5"], "at 5 s"),
        (["--slope", "30"], "allowed is -10 to 10 deg"),
        (["size", "--picture", "walk.png"], "walk"),
        (["--picture", "walk.jpg"], ".gif"),
        (["--exchange", "5"], "allowed with --elf"),
        (["--speed", "2"], "allowed is 0.5 to 1.5"),
        (["--speed", "0.8,1"], "several are allowed with `size`"),
        (["--gait", "natural-walk", "--gait", "human-walk"], "several are allowed with `size`"),
        (["--robot", "missing.toml"], "missing.toml"),
        (["--robot", "desks"], "allowed is one of desk, mini, person"),
        (["search", "--speed", "0.8", "-o", "walk.toml"], "--speed"),
        (["--kind", "wide"], "--kind wide: it is of the robots of --seeds"),
        (["size", "--kind", "wide"], "allowed with --seeds N"),
        (["size", "--robot", "person", "--robot-file", "missing.toml"], "--robot-file: it has no effect on person, which has no servo"),
        (["size", "--robot", "person", "--seeds", "2"], "--seeds: it has no effect"),
        (["size", "--robot", "person", "--slope", "2"], "--slope: it has no effect"),
        (["size", "--robot", "person", "--push", "0.1"], "--push: it has no effect"),
        (["size", "--robot", "person", "--rig", "free"], "--rig: it has no effect"),
        (["size", "--robot", "person", "--supply", "5"], "--supply: it has no effect"),
        (["defaults", "--seeds", "2"], "--seeds: `defaults` has none"),
        (["defaults", "--robot", "samples/robot.toml"], "--robot-file: `defaults` has none"),
        (["--gait", "natural_walk"], "allowed are cell-walk, "),
        (["--robot", "a.toml", "--robot-file", "b.toml"], "--robot a.toml --robot-file b.toml: both are robot files"),
        (["--robot", "mini", "--robot", "a.toml"], "--robot is given twice"),
    ],
)
def test_wrong_input_is_exit_code_2_and_says_what_is_allowed(arguments: List[str], words: str) -> None:
    code, output, messages = run(*arguments)
    assert code == 2 and output == "" and words in messages and "Traceback" not in messages, messages


@pytest.fixture(scope="module")
def slow_robot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A robot file that allows each joint 60 deg/s."""
    file: Path = tmp_path_factory.mktemp("robot") / "slow.toml"
    text, changed = re.subn(r"(?m)^rate_deg_per_s = .*$", "rate_deg_per_s = 60.0", (ROOT / "samples" / "robot.toml").read_text(encoding="utf-8"))
    assert changed == 4
    file.write_text(text, encoding="utf-8")
    return file


def test_a_gait_that_the_gate_takes_away_does_not_walk(slow_robot: Path) -> None:
    options = ["--gait", "natural-walk", "--secs", 1, "--quiet", "--robot-file"]
    found = json.loads(run(*options, "samples/robot.toml", "--json")[1])
    assert found["all"]["limited_share_mean"] == found["each"][0]["limited_share"] == 0.0 and found["walks_why_not"] is None
    code, output, messages = run(*options, slow_robot)
    words = certify(named_generator("natural-walk"), robot=slow_robot, starts=1).walks_why_not
    assert words is not None and words.startswith("limits take")
    assert code == 0 and messages.startswith("warning: natural-walk at speed 1 does not walk on this robot") and words in messages
    share = re.search(r"the gate limits (\S+) % of the control periods", output)
    assert share is not None and float(share.group(1)) > 30.0


def test_no_servo_is_enough_for_a_gait_that_the_gate_takes_away(
    slow_robot: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked: List[object] = []
    monkeypatch.setattr("footfall.body.runs.certify", lambda *given, **named: asked.append(given) or certify(*given, **named))
    options = ["size", "--gait", "natural-walk", "--secs", "1", "--seeds", "2", "--quiet", "--robot-file", str(slow_robot)]
    assert cli.main([*options, "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    (found,) = printed["runs"]
    assert [one["suffices"] for one in found["servos"]] == [False] * 3 and len(asked) == 1, "certified once, not once a seed and servo"
    # One of them follows the pulses that are left: without the certificate it is enough.
    assert any(one["falls"] == 0 and max(one["tracking_rms_deg"]) < 5.0 for one in found["servos"])
    assert found["limited_share"] > 0.3 and found["walks_why_not"].startswith("limits take") and printed["robot_file"] == str(slow_robot)
    assert cli.main(options) == 0
    output, messages = capsys.readouterr()
    assert f"desk with {slow_robot}" in output and f"none is enough: the gate limits {100.0 * found['limited_share']:.1f} %" in output
    assert found["walks_why_not"] in output and messages.count("warning: ") == 1


def test_a_gait_is_certified_at_its_speed(tmp_path: Path) -> None:
    """A rate that is enough for half of the speed, and not for one and a half."""
    file, text = tmp_path / "robot.toml", (ROOT / "samples" / "robot.toml").read_text(encoding="utf-8")
    file.write_text(re.sub(r"(?m)^rate_deg_per_s = .*$", "rate_deg_per_s = 150.0", text), encoding="utf-8")
    limited = Runs([{"limited_share": 0.5}], [], 1)
    why_not = [
        why_it_does_not_walk(argparse.Namespace(gait="natural-walk", speed=speed, robot_file=str(file)), limited) for speed in (0.5, 1.5)
    ]
    assert why_not[0] is None and why_not[1] is not None and why_not[1].startswith("limits take")


def test_results_say_what_was_run(tmp_path: Path) -> None:
    options = ["--rig", "hung", "--robot", "mini", "--robot-file", "samples/robot.toml", "--gait", "human-walk", "--speed", 1.2]
    options += ["--servo", "MG996R", "--supply", 5, "--seeds", 2, "--kind", "wide", "--slope", -2, "--push", 0.1, "--secs", 5.2]
    found = json.loads(run(*options, "--json", "--quiet")[1])
    wanted = {"rig": "hung", "robot": "mini", "robot_file": "samples/robot.toml", "gait": "human-walk", "speed": 1.2, "servo": "MG996R", "supply_v": 5.0}
    wanted.update(seeds=2, kind="wide", slope_deg=-2.0, push_ns=0.1, secs=5.2, command="walk")
    assert {name: found[name] for name in wanted} == wanted
    nominal = json.loads(run("--rig", "hung", "--secs", 1, "--json", "--quiet")[1])
    named = ("gait", "speed", "servo", "supply_v", "seeds", "kind", "robot_file", "slope_deg")
    assert [nominal[name] for name in named] == ["default walk", 1.0, "MG996R", 6.0, None, None, None, 0.0]


def test_a_picture_says_what_was_run_and_has_the_slope_of_the_floor(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: List[Any] = []
    # Drawn, so that the axes have their scale.
    monkeypatch.setattr(picture, "_save", lambda figure, _: (figure.canvas.draw(), drawn.append(figure.axes[0])))
    monkeypatch.chdir(ROOT)
    options = ["--secs", "1", "--quiet", "--picture", str(tmp_path / "walk.png"), "--gait", "natural-walk"]
    assert cli.main([*options, "--robot-file", "samples/robot.toml", "--slope", "8"]) == 0
    title = drawn[0].get_title()
    assert all(words in title for words in ("natural-walk", "samples/robot.toml", "slope 8 deg", "simulation", "nominal"))
    floor = drawn[0].lines[0]
    (x, y), (end_x, end_y) = floor.get_transform().transform(floor.get_xydata())
    assert math.degrees(math.atan2(end_y - y, end_x - x)) == pytest.approx(8.0, abs=0.01)
    times = [text.get_text().split("\n")[0] for text in drawn[0].texts]
    assert len(times) == 12 and len(set(times)) == 12, "a short run has a time of its own for each figure"


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

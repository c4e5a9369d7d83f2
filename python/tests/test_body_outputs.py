"""What ``python -m footfall.body`` writes: files that are whole or not there, work that the keyboard does not lose, exit code 1 where nothing can be written."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any, Callable, Dict, List, Tuple

import pytest

import footfall
from conftest import ROOT

pytest.importorskip("mujoco")
pytest.importorskip("matplotlib")

from footfall.body import board_feedback, cli, feedback, outputs, picture, runs, size  # noqa: E402

WALKS = ROOT / "python" / "walks"


def test_files_are_written_together_or_not_at_all(tmp_path: Path) -> None:
    first, second = tmp_path / "walk.toml", tmp_path / "robot.toml"
    first.write_text("old", encoding="utf-8")
    with pytest.raises(footfall.FootfallError, match="cannot be written"):
        outputs.write({str(first): "new", str(tmp_path / "no" / "robot.toml"): "new"})
    assert first.read_text(encoding="utf-8") == "old" and os.listdir(tmp_path) == ["walk.toml"]
    outputs.write({str(first): "new", str(second): "newer"})
    assert (first.read_text(encoding="utf-8"), second.read_text(encoding="utf-8")) == ("new", "newer")
    assert sorted(os.listdir(tmp_path)) == ["robot.toml", "walk.toml"]


def test_a_file_behind_a_link_is_replaced_and_the_link_stays(tmp_path: Path) -> None:
    (tmp_path / "real.toml").write_text("old", encoding="utf-8")
    (tmp_path / "link.toml").symlink_to(tmp_path / "real.toml")
    outputs.write({str(tmp_path / "link.toml"): "new"})
    assert (tmp_path / "link.toml").is_symlink() and (tmp_path / "real.toml").read_text(encoding="utf-8") == "new"


def test_a_check_changes_no_file(tmp_path: Path) -> None:
    (tmp_path / "walk.toml").write_text("old", encoding="utf-8")
    for name in ("walk.toml", "new.toml"):
        outputs.check_writable("-o", tmp_path / name)
    assert os.listdir(tmp_path) == ["walk.toml"] and (tmp_path / "walk.toml").read_text(encoding="utf-8") == "old"


@pytest.mark.parametrize(
    "arguments,words",
    [
        (["--picture", "FOLDER/no/walk.png"], "its folder does not exist"),
        (["--picture", "FOLDER/folder.png"], "it is a folder"),
        (["search", "-o", "FOLDER/no/walk.toml"], "-o FOLDER/no/walk.toml: its folder does not exist"),
        (["search", "-o", "FOLDER/folder.png"], "it is a folder"),
        (["search", "--rig", "free", "--robot-file", "samples/robot.toml", "-o", "FOLDER/walk.toml", "--robot-output", "FOLDER/folder.png"], "--robot-output"),
        (["worn", "--picture", "FOLDER/no/torque.png"], "its folder does not exist"),
        (["report", "--write", "FOLDER/folder.png"], "it is a folder"),
    ],
)
def test_what_cannot_be_written_is_exit_code_1_before_the_work(
    arguments: List[str], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def work(*_: Any, **__: Any) -> None:
        raise AssertionError("the work has begun")

    for place in ("footfall.body.runs.run", "footfall.body.search_cli.search", "footfall.body.search_cli.search_plane", "footfall.body.report.numbers"):
        monkeypatch.setattr(place, work)
    monkeypatch.setattr("footfall.body.wearer_cli._events", work)
    monkeypatch.chdir(ROOT)
    (tmp_path / "folder.png").mkdir()
    code = cli.main([one.replace("FOLDER", str(tmp_path)) for one in arguments])
    output, messages = capsys.readouterr()
    assert code == 1 and output == "" and words.replace("FOLDER", str(tmp_path)) in messages
    assert os.listdir(tmp_path) == ["folder.png"]


def test_one_file_is_no_gait_and_robot(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    same = str(tmp_path / "same.toml")
    code = cli.main(["search", "--rig", "free", "--robot-file", str(ROOT / "samples" / "robot.toml"), "-o", same, "--robot-output", same])
    assert code == 2 and "allowed are two names" in capsys.readouterr().err


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full, which cannot be written")
@pytest.mark.parametrize("arguments", [["defaults"], ["--rig", "hung", "--secs", "1", "--quiet", "--json"]])
def test_standard_output_that_cannot_be_written_is_exit_code_1(arguments: List[str]) -> None:
    with open("/dev/full", "w", encoding="utf-8") as full:
        command = [sys.executable, "-m", "footfall.body", *arguments]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, timeout=60, cwd=ROOT)
    assert done.returncode == 1 and done.stderr.startswith("error: standard output cannot be written: ") and done.stderr.count("\n") == 1


def test_the_numbers_come_before_a_picture_that_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def full(*_: Any, **__: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", full)
    code = cli.main(["--rig", "hung", "--secs", "1", "--quiet", "--picture", str(tmp_path / "walk.png")])
    output, messages = capsys.readouterr()
    assert code == 1 and "right_knee" in output and "cannot be written: No space left on device" in messages and os.listdir(tmp_path) == []


def _interrupted(works: Callable[..., Any], times: int) -> Callable[..., Any]:
    """A function that the keyboard stops after some calls."""
    left = [times]

    def call(*arguments: Any, **named: Any) -> Any:
        if not left[0]:
            raise KeyboardInterrupt
        left[0] -= 1
        return works(*arguments, **named)

    return call


def test_a_video_that_the_keyboard_stops_leaves_the_old_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    movie = tmp_path / "walk.gif"
    movie.write_bytes(b"old")
    monkeypatch.setattr(picture, "_body", _interrupted(picture._body, 3))
    code = cli.main(["--rig", "hung", "--secs", "1", "--quiet", "--picture", str(movie)])
    output, messages = capsys.readouterr()
    assert code == 1 and "right_knee" in output and "stopped by the keyboard" in messages
    assert movie.read_bytes() == b"old" and os.listdir(tmp_path) == ["walk.gif"]


@pytest.mark.parametrize("option", [[], ["--json"]])
def test_runs_that_have_ended_are_printed_when_the_keyboard_stops_the_others(
    option: List[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(runs, "run", _interrupted(runs.run, 2))
    code = cli.main(["--rig", "hung", "--secs", "1", "--seeds", "9", "--quiet", *option])
    output, messages = capsys.readouterr()
    assert code == 1 and "stopped by the keyboard: 2 of 9 runs have ended" in messages
    if option:
        found = json.loads(output)
        assert found["all"]["runs"] == len(found["each"]) == 2 and found["seeds"] == 9 and "2 of 9" in found["stopped"]
    else:
        assert output.startswith("2 runs, ")
    monkeypatch.setattr(runs, "run", _interrupted(runs.run, 0))
    assert cli.main(["--rig", "hung", "--secs", "1", "--seeds", "9", "--quiet"]) == 1 and capsys.readouterr().out == ""


FREE = ["--robot", "desk", "--gait", str(WALKS / "desk-free.toml"), "--robot-file", str(WALKS / "desk-free-robot.toml")]
FEEDBACK = ["feedback", *FREE, "--seeds", "2", "--quiet"]
LIMITS = feedback.Limits([False, False], [0.1, 0.2], [0.1, 0.2], [1.0, 2.0], [1.0, 2.0], 0.0)
TRIAL = board_feedback.Trial([True, False], [True, True], 0.0)
#: A command, the result of one of its parts, of which the keyboard stops the third, their list in ``--json``, what is said, and what the text has.
STOPPED: Dict[str, Tuple[List[str], Any, str, Any, str, str, str]] = {
    "size": (["size", "--robot", "person", "--speed", "1,1.2,1.4"], size, "by_inverse_dynamics", None, "runs", "2 of 3 gaits and speeds", "1.2    left_hip"),
    "feedback": ([*FEEDBACK, "--law", "reset 0.5", "--law", "reset 0.25"], feedback, "limits", LIMITS, "laws", "2 of 3 laws", "| reset 0.5 |"),
    "feedback of the loop": ([*FEEDBACK, "--loop", "0.3"], board_feedback, "trial", TRIAL, "trials", "2 of 6 trials", "| push 0.30 N s forwards |"),
}


@pytest.mark.parametrize("option", [[], ["--json"]])
@pytest.mark.parametrize("name", STOPPED)
def test_what_has_ended_is_printed_when_the_keyboard_stops_a_table(
    name: str, option: List[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments, module, work, result, key, said, line = STOPPED[name]
    works = getattr(module, work) if result is None else lambda *_, **__: result
    monkeypatch.setattr(feedback, "heel_phase", lambda *_: 0.1)
    monkeypatch.setattr(module, work, _interrupted(works, 2))
    code = cli.main([*arguments, *option])
    output, messages = capsys.readouterr()
    assert code == 1 and f"error: stopped by the keyboard: {said} have ended" in messages
    if option:
        found = json.loads(output)
        assert len(found[key]) == 2 and said in found["stopped"]
    else:
        assert line in output
    monkeypatch.setattr(module, work, _interrupted(works, 0))
    assert cli.main(arguments) == 1 and capsys.readouterr().out == ""


def test_the_table_of_worn_comes_before_a_picture_that_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def full(*_: Any, **__: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.chdir(ROOT)
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", full)
    code = cli.main(["worn", "--event", "estop", "--quiet", "--picture", str(tmp_path / "torque.png")])
    output, messages = capsys.readouterr()
    assert code == 1 and "right_knee" in output and "cannot be written: No space left on device" in messages and os.listdir(tmp_path) == []


@pytest.mark.skipif(os.name != "posix", reason="no group of processes that the keyboard reaches")
@pytest.mark.parametrize("rig", ["boom", "free"])
def test_a_search_that_the_keyboard_stops_writes_the_best_gait_so_far(rig: str, tmp_path: Path) -> None:
    pytest.importorskip("cma")
    files = ["--gait", str(WALKS / "desk-free.toml"), "-o", str(tmp_path / "walk.toml")]
    if rig == "free":
        files += ["--robot-file", str(WALKS / "desk-free-robot.toml"), "--robot-output", str(tmp_path / "robot.toml")]
    few = ["--secs", "1", "--candidates", "4", "--seeds", "1", "--jobs", "2", "--generations", "5000"]
    command = [sys.executable, "-m", "footfall.body", "search", "--rig", rig, *files, *few]

    def listen() -> None:
        # Tests that run in the background ignore the signal, and what they start would too.
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, start_new_session=True, cwd=ROOT, preexec_fn=listen) as search:
        assert search.stderr is not None
        assert search.stderr.readline().startswith("generation 1 of 5000")
        # As the keyboard does: to the processes of the pool too.
        os.killpg(search.pid, signal.SIGINT)
        output, messages = search.communicate(timeout=120)
    assert search.returncode == 1 and "Traceback" not in messages, messages
    assert "stopped by the keyboard after " in output and "wrote " in output and "simulation" in output
    assert "stopped after " in (tmp_path / "walk.toml").read_text(encoding="utf-8")
    assert footfall.Generator.read(tmp_path / "walk.toml").kind == "shape"
    written = ["robot.toml", "walk.toml"] if rig == "free" else ["walk.toml"]
    assert sorted(os.listdir(tmp_path)) == written
    if rig == "free":
        footfall.robot(tmp_path / "robot.toml")

"""The numbers of docs/body.md: those of the nominal robot are computed again and compared with the page. All of it is simulation."""

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any, Dict, List, Tuple

import pytest

from conftest import ROOT

pytest.importorskip("mujoco")
from footfall.body import report  # noqa: E402

PAGE = (ROOT / "docs" / "body.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def short() -> Dict[str, Any]:
    with pytest.MonkeyPatch.context() as patch:
        # The gaits of the list are files of the repository.
        patch.chdir(ROOT)
        return report.numbers(report.ROWS, short=True, jobs=2)


def test_the_nominal_robot_does_what_the_page_says(short: Dict[str, Any]) -> None:
    page = report.on_page(PAGE)
    lines = [line for line in short["rows"] if "nominal" in line]
    assert [line["options"] for line in lines] == list(page)
    for line in lines:
        one, (way_m, pulses, _) = line["nominal"], page[line["options"]]
        # Another kind of processor gives other bits of the path: within 2 %, and 1 cm where it does not walk. The mini robot shuffles, which is chaotic.
        tolerance = 0.5 if "mini" in line["options"] else max(0.02 * abs(way_m), 0.01)
        assert one["metres"] == pytest.approx(way_m, abs=tolerance), line["options"]
        # The pulses are those of the boards, to the bit; a gait by its name is fitted, and a fall ends a run.
        if "natural-walk" not in line["options"] and not one["fallen"]:
            assert one["pulses_sha256"].startswith(pulses), line["options"]


def test_the_sizes_of_the_page_are_those_that_are_computed(short: Dict[str, Any]) -> None:
    def sizes(lines: List[str]) -> Dict[str, List[float]]:
        cells = (line.strip("| ").split(" | ") for line in lines if line.startswith(("| desk, ", "| person, ")))
        return {joint: [float(number) for number in f"{torque}, {speed}".split(", ")] for joint, torque, speed in cells}

    page, computed = sizes(PAGE.splitlines()), sizes(report.text(short))
    assert list(page) == list(computed) and len(page) == 8
    for joint, found in computed.items():
        # A peak is that of a foot that meets the floor, which another kind of processor moves by a step.
        assert page[joint] == pytest.approx(found, rel=0.05), joint


def test_half_of_the_time_step_changes_ten_seconds_by_less_than_a_percent_and_a_half(short: Dict[str, Any]) -> None:
    halved = [line for line in short["rows"] if "halved" in line]
    assert len(halved) == len(report.HALVED) == 3
    for line in halved:
        assert line["halved"]["metres"] == pytest.approx(line["nominal"]["metres"], rel=0.015), line["options"]
        # The way is computed anew, so some digit differs; the pulses do not depend on it.
        assert line["halved"]["path_sha256"] != line["nominal"]["path_sha256"]
        assert line["halved"]["pulses_sha256"] == line["nominal"]["pulses_sha256"]


def test_two_runs_are_equal_to_the_bit_and_a_seed_changes_the_path(short: Dict[str, Any]) -> None:
    row = report.ROWS[0]
    again, other = report.one_run(row, 0), report.one_run(row, 1)
    assert again == short["rows"][0]["nominal"]
    assert other["path_sha256"] != again["path_sha256"] and other["pulses_sha256"] == again["pulses_sha256"]


def test_the_page_has_the_walks_that_are_claimed() -> None:
    found = {}
    for cells in (line.strip("| ").split(" | ") for line in PAGE.splitlines() if line.startswith("| `--rig")):
        way = re.fullmatch(r"([\d.-]+) \(([\d.-]+) to ([\d.-]+)\)", cells[1])
        if way:
            found[cells[0].strip("`")] = (float(way[1]), cells[2], float(cells[8].split(", ")[0]))
    assert list(found) == [row.options for row in report.ROWS]
    assert found["--rig boom --gait natural-walk"][0] >= 3.0
    metres, falls, stall_share = found["--rig boom --gait python/walks/desk-boom.toml"]
    assert metres >= 6.0 and falls == "0 of 20" and stall_share <= 0.35
    for more, most_falls in (("", 0), (" --kind wide", 1), (" --push 0.15", 0), (" --push -0.15", 0)):
        metres, falls, _ = found[report._FREE + more]
        assert metres >= 4.0 and falls.endswith(" of 20") and int(falls.split()[0]) <= most_falls, more
    for more in (" --slope 1", " --slope -1"):
        metres, falls, _ = found[report._FREE + more]
        assert metres >= 3.5 and falls in ("0 of 20", "1 of 20"), more


def test_a_launch_at_another_phase_may_fall() -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        patch.setattr(report, "LAUNCH_SEEDS", 2)
        found = report.launches()
        lines = report._launch_lines(found)
    assert [one["later_s"] for one in found] == pytest.approx([0.825 * n / 8.0 for n in range(8)], abs=0.001) and found[0]["falls"] == 0
    falls = sum(one["falls"] for one in found)
    assert 0 < falls < 16 and f"{falls} of 16 launches fall" in lines[0] and len(lines) == 12


def run(*arguments: object) -> Tuple[int, str, str]:
    command: List[str] = [sys.executable, "-m", "footfall.body", "report", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=ROOT)
    return done.returncode, done.stdout, done.stderr


def test_the_command_prints_the_tables_and_runs_some_lines_alone() -> None:
    code, output, messages = run("--short", "--only", "hung", "--jobs", 1)
    assert code == 0 and messages.count("run 1 of 1") == 1, messages
    assert output.count("`--rig hung`") == 1 and "person, left knee" in output
    code, output, _ = run("--short", "--only", "hung", "--json", "--quiet")
    (line,) = json.loads(output)["rows"]
    assert code == 0 and re.fullmatch("[0-9a-f]{64}", line["nominal"]["path_sha256"])


@pytest.mark.parametrize(
    "arguments,words",
    [
        (["--only", "trot"], "--rig hung"),
        (["--short", "--write", "docs/body.md"], "without --short"),
        (["--jobs", "0"], "allowed is 1 or more"),
        (["--launches", "--short"], "--launches: it has no tables of the page"),
    ],
)
def test_wrong_input_is_exit_code_2_and_says_what_is_allowed(arguments: List[str], words: str) -> None:
    code, output, messages = run(*arguments)
    assert code == 2 and output == "" and words in messages, messages


@pytest.mark.parametrize("arguments", [["report", "--short"], ["report", "--launches"], ["worn"]])
def test_outside_of_a_clone_it_says_at_once_where_to_run(arguments: List[str], tmp_path: Path) -> None:
    command = [sys.executable, "-m", "footfall.body", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, cwd=tmp_path)
    assert done.returncode == 2 and "run 1" not in done.stderr and "in the folder of a clone that has README.md" in done.stderr, done.stderr


def test_a_page_gets_its_tables_between_the_marks(tmp_path: Path, short: Dict[str, Any]) -> None:
    page = tmp_path / "page.md"
    page.write_text(f"before\n{report._MARKS[0]}\nold\n{report._MARKS[1]}\nafter\n", encoding="utf-8")
    report._write(str(page), report.text(short))
    text = page.read_text(encoding="utf-8")
    assert text.startswith("before\n") and text.endswith("\nafter\n") and "\nold\n" not in text
    assert list(report.on_page(text)) == list(report.on_page(PAGE))

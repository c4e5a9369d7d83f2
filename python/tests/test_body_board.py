"""A body that the flashed image drives on the virtual board, and one that the control loop in this process drives: the same pulses.

``FOOTFALL_ELF``, ``FOOTFALL_VIRTUAL_BOARD`` and ``FOOTFALL_BIN`` name the image and the programs; ``cargo xtask test`` sets them.
"""

import json
import os
import re
import statistics
import subprocess
import sys
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence

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
from footfall.body.board_feedback import KNEES, with_share  # noqa: E402
from footfall.body.by_name import named_generator  # noqa: E402


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
    with body.BoardDriver(os.environ["FOOTFALL_ELF"], robot=record) as driver:
        farther = body.run(body.Body(body.DESK, "boom"), driver, 2.0, exchange_ms=5)
    np.testing.assert_array_equal(farther.trunk, board.trunk)
    count = min(len(board.pulses_us), len(loop.pulses_us))
    assert count >= 99
    np.testing.assert_allclose(board.pulses_us[:count], loop.pulses_us[:count], atol=0.0)
    assert float(np.ptp(board.pulses_us[:, 0])) > 100.0, "it walks"
    np.testing.assert_allclose(board.trunk[-1], loop.trunk[-1], atol=0.02)


@pytest.mark.parametrize("rig,gait,robot,least_m", [
    ("boom", "natural-walk", None, 3.0),
    ("boom", "python/walks/desk-boom.toml", None, 6.0),
    ("free", "python/walks/desk-free.toml", "python/walks/desk-free-robot.toml", 4.0),
])
def test_the_image_walks_ten_seconds(record: Path, tmp_path: Path, rig: str, gait: str, robot: Optional[str], least_m: float) -> None:
    """A gait from its generator record, as the command line runs it: the way of docs/body.md, and the pulses of the control loop to the bit."""
    generator, program = named_generator(str(ROOT / gait) if "/" in gait else gait), os.environ["FOOTFALL_BIN"]
    (tmp_path / "gait.toml").write_text(body.Gait.of(generator).text("") if gait == "natural-walk" else (ROOT / gait).read_text(encoding="utf-8"), encoding="utf-8")
    subprocess.run([program, "pack", str(tmp_path / "gait.toml"), "-o", str(tmp_path / "g.bin")], capture_output=True, check=True)
    file = None if robot is None else ROOT / robot
    if file is not None:
        record = tmp_path / "r.bin"
        subprocess.run([program, "pack", "--robot", str(file), "-o", str(record)], capture_output=True, check=True)
    options = ["--elf", os.environ["FOOTFALL_ELF"], "--robot-record", record, "--generator-record", tmp_path / "g.bin", "--rig", rig]
    options += [] if file is None else ["--robot-file", file]
    command = [sys.executable, "-m", "footfall.body", *map(str, options), "--exchange", "20", "--json", "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    (image,) = json.loads(done.stdout)["each"]
    one = body.Body(body.DESK, rig, robot_file=file)
    loop = body.run(one, body.LoopDriver(generator, robot=file), 10.0, until=body.fallen)
    assert image["pulses_sha256"] == body.hashes(loop)["pulses_sha256"] and len(loop.pulses_us) == 500
    assert not image["fallen"] and image["seconds"] == 10.0 and image["metres"] > least_m
    # The way may differ by what the microseconds of a pulse's edge on the board do.
    assert image["metres"] == pytest.approx(loop.trunk[-1, 0], rel=0.01)


@pytest.fixture(scope="module")
def with_feedback(tmp_path_factory: pytest.TempPathFactory) -> Dict[str, Path]:
    """The gait that walks free in the plane, its robot with feedback at both knees, and the sensors there: the robot file and three records."""
    folder, program = tmp_path_factory.mktemp("feedback"), os.environ["FOOTFALL_BIN"]
    files = {name: folder / name for name in ("robot.toml", "sensor.toml", "robot.bin", "sensors.bin", "gait.bin")}
    robot = with_share((ROOT / "python" / "walks" / "desk-free-robot.toml").read_text(encoding="utf-8"), 0.3)
    files["robot.toml"].write_text(robot, encoding="utf-8")
    files["sensor.toml"].write_bytes(subprocess.run([program, "defaults", "sensor"], capture_output=True, check=True).stdout)
    sensors = [word for joint, _ in KNEES for word in ("--sensor", f"{joint}={files['sensor.toml']}")]
    packed = {"robot.bin": ["--robot", files["robot.toml"]], "sensors.bin": sensors, "gait.bin": [ROOT / "python" / "walks" / "desk-free.toml"]}
    for name, what in packed.items():
        subprocess.run([program, "pack", *map(str, what), "-o", str(files[name])], capture_output=True, check=True)
    return files


def fed_back(files: Dict[str, Path], *arguments: object) -> Any:
    """A run of the image free in the plane, by the command line."""
    options = ["--elf", os.environ["FOOTFALL_ELF"], "--robot-file", files["robot.toml"], "--robot-record", files["robot.bin"]]
    options += ["--generator-record", files["gait.bin"], "--rig", "free"]
    options += ["--sensor-record", files["sensors.bin"]] if "sensors.bin" in files else []
    command = [sys.executable, "-m", "footfall.body", "--json", "--quiet", *map(str, [*options, *arguments])]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    (one,) = json.loads(done.stdout)["each"]
    return one


class FedBackLoop(body.LoopDriver):
    """The loop of an image whose pulses depend on its sensors.

    The virtual board reports a servo frame 2.1 ms after its beginning, when its pulses have ended: the board is ahead of the body. Of the four
    conversions of a tick ``earlier`` are in the millisecond before that of the others, by the time that the image takes to boot. Its converter rounds to
    the nearest of 4095 codes, and its tick takes the mean of the middle two, a half to the even code.
    """

    def __init__(self, *arguments: Any, earlier: int, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._earlier, self._before = earlier, [0]

    def _code(self, volt: float) -> int:
        return int(volt)

    def _tick(self, volts: Sequence[float], *, button: bool = False, stop: bool = False) -> Optional[body.Frame]:
        now = [round(volt / self._SUPPLY_V * 4095.0) for volt in volts]
        before, self._before = self._before if self._ticks else now, now
        codes = [statistics.median([old] * self._earlier + [new] * (4 - self._earlier)) for old, new in zip(before, now)]
        return super()._tick([float(round(code)) for code in codes], button=button, stop=stop)

    def arm(self, volts: Sequence[float]) -> List[body.Frame]:
        return super().arm(volts) + self.step(2000, volts)


def test_the_image_walks_with_feedback(with_feedback: Dict[str, Path]) -> None:
    """The knees' sensors move its pulses as they move those of the control loop: to the bit."""
    image = fed_back(with_feedback)
    generator = footfall.Generator.read(ROOT / "python" / "walks" / "desk-free.toml")
    def run(robot: Path, earlier: int) -> Any:
        one = body.Body(body.DESK, "free", robot_file=robot)
        return body.run(one, FedBackLoop(generator, robot=robot, sensors=KNEES, earlier=earlier), 10.0, sensors=KNEES, until=body.fallen)

    runs = (run(with_feedback["robot.toml"], earlier) for earlier in range(5))
    same = next((one for one in runs if body.hashes(one)["pulses_sha256"] == image["pulses_sha256"]), None)
    assert same is not None and len(same.pulses_us) == 500, image
    # Without feedback the sensors move nothing, so any number is right.
    without = run(ROOT / "python" / "walks" / "desk-free-robot.toml", 0)
    assert body.hashes(without)["pulses_sha256"] != image["pulses_sha256"]
    assert not image["fallen"] and image["seconds"] == 10.0 and image["metres"] > 4.0
    assert image["metres"] == pytest.approx(same.trunk[-1, 0], abs=1e-6)


def test_the_image_recovers_from_a_push_by_feedback_alone(with_feedback: Dict[str, Path], tmp_path: Path) -> None:
    """A robot that the same push makes fall without feedback; `feedback --loop` counts how many there are."""
    push = ["--seeds", "1", "--push", "0.3"]
    stands = fed_back(with_feedback, *push)
    assert not stands["fallen"] and stands["seconds"] == 10.0 and stands["metres"] > 4.0
    robot, record = ROOT / "python" / "walks" / "desk-free-robot.toml", tmp_path / "robot.bin"
    subprocess.run([os.environ["FOOTFALL_BIN"], "pack", "--robot", str(robot), "-o", str(record)], capture_output=True, check=True)
    falls = fed_back({"gait.bin": with_feedback["gait.bin"], "robot.toml": robot, "robot.bin": record}, *push)
    assert falls["fallen"] and 5.0 < falls["seconds"] < 7.0


def test_a_sensor_record_is_asked_for(with_feedback: Dict[str, Path]) -> None:
    options = ["--elf", os.environ["FOOTFALL_ELF"], "--robot-file", with_feedback["robot.toml"], "--robot-record", with_feedback["robot.bin"]]
    command = [sys.executable, "-m", "footfall.body", *map(str, options)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, cwd=ROOT)
    assert done.returncode == 2 and "pack --sensor left_knee=sensor.toml --sensor right_knee=sensor.toml -o sensors.bin" in done.stderr


def test_the_command_line_takes_an_image(record: Path) -> None:
    arguments = ["--elf", os.environ["FOOTFALL_ELF"], "--robot-record", str(record), "--secs", "1", "--exchange", "10", "--json", "--quiet"]
    done = subprocess.run([sys.executable, "-m", "footfall.body", *arguments], capture_output=True, text=True, timeout=300, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["all"]["runs"] == 1


@pytest.fixture(scope="module")
def worn_options(record: Path, tmp_path_factory: pytest.TempPathFactory) -> List[str]:
    """Options of `worn` with the image: a follower that is fitted to the recording of the repository, and its records."""
    folder, program = tmp_path_factory.mktemp("worn"), os.environ["FOOTFALL_BIN"]
    follower = folder / "follower.toml"
    footfall.fit(ROOT / "tests" / "traces" / "gaitkit_fukuchi_healthy.csv", follow="left_hip", starts=10).save(follower)
    (folder / "sensor.toml").write_bytes(subprocess.run([program, "defaults", "sensor"], capture_output=True, check=True).stdout)
    subprocess.run([program, "pack", str(follower), "-o", str(folder / "follower.bin")], capture_output=True, check=True)
    sensors = ["pack", "--sensor", f"left_hip={folder / 'sensor.toml'}", "-o", str(folder / "sensors.bin")]
    subprocess.run([program, *sensors], capture_output=True, check=True)
    options = ["--elf", os.environ["FOOTFALL_ELF"], "--robot-record", record, "--generator-record", folder / "follower.bin"]
    return [str(one) for one in [*options, "--sensor-record", folder / "sensors.bin", "--follower", follower]]


def worn(*arguments: object) -> Any:
    command = [sys.executable, "-m", "footfall.body", "worn", "--json", "--quiet", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_the_image_does_to_a_limb_what_the_control_loop_does(worn_options: List[str]) -> None:
    tables = [worn("--event", "steady", "--event", "estop", *more)["tables"] for more in ([], worn_options)]
    (loop,), (image,) = (list(table.values()) for table in tables)
    for of_loop, of_image in zip(loop, image):
        for joint in footfall.JOINTS:
            for key in ("rms_nm", "p95_nm"):
                assert of_image["joints"][joint][key] == pytest.approx(of_loop["joints"][joint][key], rel=0.03), (of_loop["event"], joint, key)
    assert max(one["motor_until_s"] for one in image[1]["joints"].values()) <= 0.003, "the emergency stop takes the supply"


def test_a_reset_takes_the_torque(worn_options: List[str]) -> None:
    (table,) = worn("--event", "reset", *worn_options)["tables"].values()
    for joint, one in table[0]["joints"].items():
        assert one["motor_until_s"] <= 0.003 and one["p95_nm"] < 0.5, joint


def test_faults_of_the_campaign_come_to_a_person_who_wears_it(worn_options: List[str]) -> None:
    found = worn("--faults", "tests/campaign/faults.toml", "--only", "TIM1 PSC, bit 3", *worn_options)
    assert found["run"] == 1 and found["faults"] > 400
    (one,) = found["each"]
    # A tick finds the register, and switches the supply off.
    assert one["injected"] and one["violations"] == 0 and 0.0 < one["off_s"] < 0.005
    (loses,) = worn("--faults", "tests/campaign/faults.toml", "--only", "loses a result", *worn_options)["each"]
    assert loses["injected"] and loses["off_s"] is None, "it walks on"


def test_the_bits_of_the_memory_are_those_of_the_campaign(record: Path) -> None:
    from footfall.body import faults

    elf = os.environ["FOOTFALL_ELF"]
    names = {fault.name for fault in faults.of_file(ROOT / "tests" / "campaign" / "faults.toml", "walking", elf) if "static RAM" in fault.name}
    options = ["--loop", "--volts", "tests/traces/gaitkit_fukuchi_healthy_left_knee_volts.csv", "--flash", f"0x0800C000={record}"]
    options += ["--campaign", "tests/campaign/faults.toml", "--run", "walk", "--only", "static RAM", "--every", "40"]
    done = subprocess.run([os.environ["FOOTFALL_VIRTUAL_BOARD"], elf, *options], capture_output=True, text=True, timeout=300, cwd=ROOT)
    drawn = set(re.findall(r"static RAM, 0x[0-9a-f]{8} bit \d", done.stdout))
    assert len(names) == 60 and len(drawn) > 10 and drawn <= names, done.stderr

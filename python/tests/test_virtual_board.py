"""The side of Python of the conversation with the virtual board, against a program that plays the board: errors, shapes, gestures."""

import json
import os
import stat
import sys
import tempfile
from pathlib import Path
from typing import Any, Dict, List

import numpy as np
import pytest

import footfall

#: Plays the board: it writes down the requests, and answers each as the file ``answers`` says, with the last one again and again.
PLAYER = """#!{python}
import json, sys
version, folder = {version}, {folder!r}
print(json.dumps({{"type": "lockstep", "version": version, "joints": {joints}}}), flush=True)
answers = json.load(open(folder + "/answers"))
t_us = 0
with open(folder + "/requests", "w") as requests:
    requests.write(json.dumps(sys.argv[1:]) + "\\n")
    for text in sys.stdin:
        requests.write(text)
        requests.flush()
        answer = answers.pop(0) if len(answers) > 1 else answers[0]
        if answer is None:
            sys.exit("the player is gone")
        t_us += json.loads(text)["us"]
        for line in answer:
            print(json.dumps(dict(line, t_us=t_us) if line["type"] == "step" else line), flush=True)
judged = {{"pulses": 8, "cut": 0, "violations": {violations}, "first": ["PE9 at 1.0 s: too fast"][:{violations}]}}
print(json.dumps({{"type": "end", "t_s": t_us / 1e6, "reason": "time", "lints": [], "judged": judged}}), flush=True)
sys.exit({violations})
"""

JOINTS = [
    {"pin": pin, "joint": joint, "neutral_us": 1500.0, "deg_at_neutral": at, "us_per_deg": scale}
    for pin, joint, at, scale in zip(("PE9", "PE11", "PE13", "PE14"), footfall.JOINTS, (0.0, 0.0, 45.0, 45.0), (10.0, -10.0, 10.0, -10.0))
]

STEP: Dict[str, Any] = {"type": "step", "armed": False, "rail": False, "lamps": []}


class Player:
    """A program that plays the board."""

    def __init__(self, folder: Path, answers: List[Any], *, version: int = 1, joints: Any = JOINTS, violations: int = 0) -> None:
        self.folder, self.program, self.elf = folder, folder / "virtual-board", folder / "firmware.elf"
        text = PLAYER.format(python=sys.executable, version=version, folder=str(folder), joints=repr(joints), violations=violations)
        self.program.write_text(text)
        self.program.chmod(self.program.stat().st_mode | stat.S_IXUSR)
        self.elf.write_bytes(b"ELF")
        (folder / "answers").write_text(json.dumps(answers))

    def board(self, **options: Any) -> footfall.VirtualBoard:
        return footfall.VirtualBoard(self.elf, emulator=self.program, **options)

    def requests(self) -> List[Any]:
        return [json.loads(line) for line in (self.folder / "requests").read_text().splitlines()]


def test_without_a_program_the_error_says_how_to_build_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    player = Player(tmp_path, [[STEP]])
    monkeypatch.delenv("FOOTFALL_VIRTUAL_BOARD", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path / "empty"))
    with pytest.raises(FileNotFoundError, match="cargo build --profile host -p virtual-board"):
        footfall.VirtualBoard(player.elf)
    monkeypatch.setenv("FOOTFALL_VIRTUAL_BOARD", str(tmp_path / "nothing"))
    with pytest.raises(FileNotFoundError, match="nothing: no such file"):
        footfall.VirtualBoard(player.elf)
    with pytest.raises(FileNotFoundError, match="other.elf: no such file"):
        footfall.VirtualBoard(tmp_path / "other.elf", emulator=player.program)
    with pytest.raises(FileNotFoundError, match="robot.bin: no such file"):
        player.board(robot=tmp_path / "robot.bin")
    for name, value in (("FOOTFALL_VIRTUAL_BOARD", str(player.program)), ("PATH", str(tmp_path) + os.pathsep + os.environ["PATH"])):
        monkeypatch.delenv("FOOTFALL_VIRTUAL_BOARD", raising=False)
        monkeypatch.setenv(name, value)
        with footfall.VirtualBoard(player.elf) as board:
            board.step(0.001)


def test_options_and_records_reach_the_program(tmp_path: Path) -> None:
    player = Player(tmp_path, [[STEP]])
    for name in ("g", "s", "r", "script"):
        (tmp_path / name).write_bytes({"g": b"FFWK", "s": b"FFSN", "r": b"FFRB"}.get(name, b""))
    records = {key: tmp_path / key[0] for key in ("generator", "sensors", "robot")}
    with player.board(**records, servo="digital", servo_at_deg=[0, 0, 5, 5], script=tmp_path / "script", options=["--cpi", "2"]) as board:
        board.step(0.001)
    got = player.requests()[0]
    assert got[:4] == [str(player.elf), "--lockstep", "--cpi", "2"]
    assert got[4:10] == ["--flash", f"0x08004000={tmp_path}/g", "--flash", f"0x08008000={tmp_path}/s", "--flash", f"0x0800c000={tmp_path}/r"]
    assert got[10:] == ["--servo", "digital", "--servo-at", "0.0,0.0,5.0,5.0", "--script", f"{tmp_path}/script"]


def test_inputs_are_those_of_the_protocol(tmp_path: Path) -> None:
    player = Player(tmp_path, [[STEP]])
    with player.board() as board:
        board.step(0.001, {"PA1": 1.5, "VDD": 3, "PC1": (0.5, 1.0)}, button=True, stop=False, foot=True, levels={"PC6": False})
        board.step(0.0025, [1.0, 2.0])
        board.step(1e-6, np.array([[1.0, 2.0, 3.0, 0.5], [1.5, 2.5, 3.0, 0.25]]))
        assert board.time_s == 0.003501
    first, second, third = player.requests()[1:]
    assert first == {
        "us": 1000,
        "volts": {"PA1": 1.5, "VDD": 3.0, "PC1": [0.5, 1.0]},
        "button": True,
        "stop": False,
        "levels": {"PC6": False, "PC5": True},
    }
    assert second == {"us": 2500, "volts": {"PA1": 1.0, "PC1": 2.0}}
    assert third == {"us": 1, "volts": {"PA1": [1.0, 1.5], "PC1": [2.0, 2.5], "PB0": [3.0, 3.0], "PB1": [0.5, 0.25]}}


@pytest.mark.parametrize("seconds", [0.0, -0.001, 0.0000015, float("nan"), float("inf")])
def test_a_step_is_whole_microseconds(tmp_path: Path, seconds: float) -> None:
    with Player(tmp_path, [[STEP]]).board() as board:
        with pytest.raises(footfall.InputError, match="whole number of microseconds"):
            board.step(seconds)


@pytest.mark.parametrize("shape", [(0,), (5,), (3, 1), (1, 1, 1), ()])
def test_an_array_of_volts_has_a_column_for_each_sensor(tmp_path: Path, shape: "tuple[int, ...]") -> None:
    with Player(tmp_path, [[STEP]]).board() as board:
        with pytest.raises(footfall.InputError, match="volts has the shape"):
            board.step(0.001, np.zeros(shape))


def test_a_refused_step_is_an_error_of_the_input(tmp_path: Path) -> None:
    error = {"type": "error", "field": "volts.PE9", "text": "PE9 is not a pin of a converter"}
    with Player(tmp_path, [[error], [STEP]]).board() as board:
        with pytest.raises(footfall.InputError, match="PE9 is not a pin of a converter"):
            board.step(0.001, {"PE9": 1.0})
        board.step(0.001)


def test_the_result_has_arrays_and_angles(tmp_path: Path) -> None:
    lines = [
        {"type": "start", "elf_sha256": "00"},
        {"type": "boot", "t_s": 0.0, "cause": "power_on"},
        {"type": "rtt", "t_s": 0.001, "channel": 1, "hex": "0aff"},
        {"type": "rtt", "t_s": 0.001, "channel": 0, "hex": "0bfe"},
        {"type": "pulses", "t_s": 0.02, "us": [1500.0, 1400.0, None, 1700.0], "rail": True},
        {"type": "injected", "t_s": 0.03, "kind": "vdd", "symbol": "a dip"},
        {"type": "rtt", "t_s": 0.002, "channel": 1, "hex": "01"},
        {"type": "status", "t_s": 0.1},
        dict(STEP, armed=True, rail=True, lamps=[{"t_s": 0.01, "pin": "PD12", "on": True}], deg=[0, 90, -90, 180], torque=[1, 1, 1, 1]),
    ]
    with Player(tmp_path, [lines, [STEP]]).board() as board:
        step = board.step(0.1)
        empty = board.step(0.001)
        angles = np.degrees(board.joint_angles(step.pulses.us))
        with pytest.raises(footfall.InputError, match="one column a joint"):
            board.joint_angles([1500.0])
    assert (step.time_s, step.armed, step.rail, step.lamps, step.log) == (0.1, True, True, {"PD12": True}, b"\x0a\xff\x01")
    assert step.boots == [footfall.Boot(0.0, "power_on")]
    np.testing.assert_array_equal(step.pulses.us, [[1500.0, 1400.0, np.nan, 1700.0]])
    assert step.pulses.time_s.tolist() == [0.02] and step.pulses.rail.tolist() == [True]
    assert step.servo_rad is not None and step.servo_rad.tolist() == pytest.approx([0.0, np.pi / 2, -np.pi / 2, np.pi])
    assert [event["type"] for event in step.events] == ["injected"]
    np.testing.assert_allclose(angles, [[0.0, 10.0, np.nan, 25.0]])
    assert empty.pulses.us.shape == (0, 4) and empty.servo_rad is None and empty.log == b""


def test_the_gestures_are_those_of_a_person(tmp_path: Path) -> None:
    armed = dict(STEP, armed=True, rail=True)
    player = Player(tmp_path, [[STEP]] * 145 + [[armed]])
    seen: List[float] = []

    def body(step: footfall.Step) -> "list[float]":
        seen.append(step.time_s)
        return [1.0]

    with player.board() as board:
        assert board.arm(body, step_s=0.005).armed
    requests = player.requests()[1:]
    pressed = [(index * 5, key, request[key]) for index, request in enumerate(requests) for key in ("button", "stop") if key in request]
    assert pressed == [(50, "stop", True), (150, "stop", False), (200, "button", True), (700, "button", False)]
    assert len(requests) == 146 and len(seen) == 145
    assert all(request["volts"] == {"PA1": 1.0} for request in requests[1:])
    with Player(tmp_path, [[STEP]]).board() as board:
        with pytest.raises(footfall.BoardError, match="does not arm"):
            board.arm(step_s=0.01)


def test_a_run_that_is_not_good_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(footfall.BoardError, match="PE9 at 1.0 s: too fast"):
        with Player(tmp_path, [[STEP]], violations=1).board() as board:
            board.step(0.001)
    verdict = board.close()
    assert (verdict.exit_code, verdict.pulses, verdict.violations, verdict.good) == (1, 8, 1, False)
    with pytest.raises(footfall.BoardError, match="the run has ended"):
        board.step(0.001)
    # An error of the program in the block is the one that is seen.
    with pytest.raises(ZeroDivisionError):
        with Player(tmp_path, [[STEP]], violations=1).board() as board:
            raise ZeroDivisionError


def test_a_program_that_ends_or_is_another_one_is_an_error(tmp_path: Path) -> None:
    board = Player(tmp_path, [[STEP], None]).board()
    board.step(0.001)
    with pytest.raises(footfall.BoardError, match="the player is gone"):
        board.step(0.001)
    ended = {"type": "end", "t_s": 0.002, "reason": "lint", "judged": {}}
    with pytest.raises(footfall.BoardError, match="ended by itself at 0.002 s: lint"):
        Player(tmp_path, [[ended]]).board().step(0.001)
    with pytest.raises(footfall.BoardError, match="speaks version 2 of the protocol, this package version 1"):
        Player(tmp_path, [[STEP]], version=2).board()
    with Player(tmp_path, [[STEP]], joints=None).board() as dark:
        with pytest.raises(footfall.InputError, match="no valid robot record"):
            dark.joint_angles([1500.0] * 4)


def test_a_board_that_does_not_arm_says_why(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lamps = [{"pin": "PD14", "on": True}, {"pin": "PD12", "on": True}, {"pin": "PD12", "on": False}]
    player = Player(tmp_path, [[{"type": "rtt", "channel": 1, "hex": "0102"}, dict(STEP, lamps=lamps)], [STEP]])
    board = player.board()
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    with pytest.raises(footfall.BoardError, match="lamps that are lit: PD14; .* `log` .* `footfall watch --rtt ") as raised:
        board.arm(step_s=0.01)
    assert raised.value.log == b"\x01\x02"
    assert not list(temporary.iterdir()), "no file is left behind"


def test_a_file_that_is_no_record_is_refused(tmp_path: Path, samples: Path) -> None:
    player = Player(tmp_path, [[STEP]])
    with pytest.raises(footfall.InputError, match="robot.toml: is a TOML file, not a record; allowed is a robot record.*`footfall pack --robot robot.toml"):
        player.board(robot=samples / "robot.toml")
    with pytest.raises(footfall.InputError, match="sensor.toml: is a TOML file, not a record; .*`footfall pack --sensor"):
        player.board(sensors=samples / "sensor.toml")
    record = tmp_path / "robot.bin"
    record.write_bytes(b"FFRB" + bytes(20))
    with pytest.raises(footfall.InputError, match="generator = .*robot.bin: is a robot record; allowed is a generator record"):
        player.board(generator=record)
    player.board(robot=record).close()
    assert "0x0800c000=" + str(record) in player.requests()[0]


def test_threads_step_one_after_the_other(tmp_path: Path) -> None:
    import threading

    times: List[float] = []
    with Player(tmp_path, [[STEP]]).board() as board:
        threads = [threading.Thread(target=lambda: times.extend(board.step(0.001).time_s for _ in range(300)), daemon=True) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(timeout=60.0)
        assert not any(thread.is_alive() for thread in threads)
    assert sorted(times) == pytest.approx([0.001 * at for at in range(1, 1201)])


def test_the_program_ends_with_the_last_reference(tmp_path: Path) -> None:
    import gc

    board = Player(tmp_path, [[STEP]]).board()
    board.step(0.001)
    process = board._process
    del board
    gc.collect()
    assert process.poll() is not None


@pytest.mark.parametrize(
    "volts, words",
    [
        ([1.0, float("nan")], r"volts\[1\] = nan, pin PC1: allowed is a finite number of volts"),
        (np.array([[1.0, 1.0], [1.0, np.inf]]), r"volts\[1, 1\] = inf, pin PC1: "),
        ({"PA1": float("-inf")}, r"volts\['PA1'\] = -inf: "),
        ({"VDDA": [3.0, float("nan")]}, r"volts\['VDDA'\] = .*nan.*: allowed is a finite"),
    ],
)
def test_volts_are_finite(tmp_path: Path, volts: Any, words: str) -> None:
    with Player(tmp_path, [[STEP]]).board() as board:
        with pytest.raises(footfall.InputError, match=words):
            board.step(0.001, volts)
        board.step(0.001, [1.0, 1.0])

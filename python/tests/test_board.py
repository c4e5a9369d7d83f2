"""The flashed image on the virtual board, recorded, and run again from Python: the same setpoints, and the same hash.

``FOOTFALL_ELF``, ``FOOTFALL_VIRTUAL_BOARD`` and ``FOOTFALL_BIN`` name the image and the programs; ``cargo xtask test`` sets them.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any, Dict, Tuple

import numpy as np
import pytest

import footfall

NEEDED = ("FOOTFALL_ELF", "FOOTFALL_VIRTUAL_BOARD", "FOOTFALL_BIN")

pytestmark = pytest.mark.skipif(
    any(name not in os.environ for name in NEEDED), reason="no image and virtual board; the step python-board has them"
)

Run = Tuple[Path, Dict[str, Any]]


@pytest.fixture(scope="module", params=["mcap", "csv"])
def run(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Run:
    """The recording of a run of 6 s, and its result as the virtual board's program states it."""
    capture = tmp_path_factory.mktemp("board") / f"walk.{request.param}"
    elf, board, program = (os.environ[name] for name in NEEDED)
    command = [program, "watch", "--elf", elf, "--virtual-board", board, "--secs", "6", "--json", "--record", str(capture)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return capture, json.loads(done.stdout.splitlines()[-1])


def test_a_loop_in_python_has_the_hash_of_the_board(run: Run) -> None:
    capture, result = run
    recorded = footfall.read_capture(capture)
    inputs = recorded.inputs()
    loop = recorded.joint_loop()
    ticks = loop.run(
        inputs.codes,
        inputs.vrefint,
        button=inputs.button,
        foot=inputs.foot,
        late=inputs.late,
        fault_bits=inputs.fault_bits,
        elapsed=inputs.elapsed,
        watchdog_hz=inputs.watchdog_hz,
        debugger=inputs.debugger,
        program_unproven=inputs.program_unproven,
        requests=inputs.requests,
    )
    np.testing.assert_array_equal(ticks.tick, inputs.tick)
    (row,) = np.flatnonzero(ticks.tick == result["ticks"])
    assert f"{ticks.setpoint_hash[row]:016x}" == result["setpoint_hash"]
    assert result["ticks"] > 5900 and ticks.state[row] == result["state"] == "walking"


def test_setpoints_and_pulses_are_those_of_the_recording(run: Run) -> None:
    recorded = footfall.read_capture(run[0])
    inputs, outputs = recorded.inputs(), recorded.outputs()
    ticks = recorded.joint_loop().run(inputs.codes, inputs.vrefint, button=inputs.button, fault_bits=inputs.fault_bits, watchdog_hz=inputs.watchdog_hz)
    assert outputs.known.all() and outputs.setpoints_deg.shape == (len(recorded), 4)
    in_degrees = ticks.setpoints_rad * np.float32(180.0 / np.float32(np.pi))
    np.testing.assert_array_equal(in_degrees, outputs.setpoints_deg)
    np.testing.assert_array_equal(ticks.pulses_us, outputs.pulses_us)
    assert [str(state) for state in ticks.state] == outputs.state


def test_the_replay_compares_every_tick(run: Run) -> None:
    found = footfall.read_capture(run[0]).replay()
    assert found["different"] == found["not_replayed"] == 0 and found["compared"] == found["ticks"] > 5900


def test_another_input_gives_another_hash(run: Run) -> None:
    recorded = footfall.read_capture(run[0])
    inputs = recorded.inputs()
    press = inputs.button.copy()
    press[4000:4100] = True
    loops = [recorded.joint_loop(), recorded.joint_loop()]
    for loop, button in zip(loops, (inputs.button, press)):
        loop.run(inputs.codes, inputs.vrefint, button=button, fault_bits=inputs.fault_bits, watchdog_hz=inputs.watchdog_hz)
    assert loops[0].setpoint_hash != loops[1].setpoint_hash


def test_the_example_prints_the_hash(run: Run) -> None:
    capture, result = run
    example = Path(__file__).resolve().parents[1] / "examples" / "replay.py"
    done = subprocess.run([sys.executable, str(example), str(capture)], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert " 0 different" in done.stdout and "hash" in done.stdout

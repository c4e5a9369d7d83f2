"""Errors: their classes, and words that say what is allowed."""

from pathlib import Path
from typing import Any, Callable, Dict

import numpy as np
import pytest

import footfall

GENERATOR = footfall.Generator
WRONG: Dict[str, Callable[[Path], Any]] = {
    "a gait without name": lambda _: GENERATOR.gait("trot"),
    "speed and cadence": lambda _: GENERATOR.gait("run", speed=1.0, cadence=160),
    "a cadence out of range": lambda _: GENERATOR.gait("human-walk", cadence=200),
    "a speed that is no number": lambda _: GENERATOR.gait("run", speed=float("nan")),
    "a default without name": lambda _: GENERATOR.default("x"),
    "a period of 0": lambda _: GENERATOR.default(period_s=0),
    "a period that is too long": lambda _: GENERATOR.default(period_s=0.1),
    "a text that is no file": lambda _: GENERATOR.parse("x = 1"),
    "seconds below 0": lambda _: GENERATOR.default().run(-1),
    "seconds without end": lambda _: GENERATOR.default().run(float("inf")),
    "steps below 0": lambda _: GENERATOR.default().step(-1),
    "every 0": lambda _: GENERATOR.default().run(1.0, every=0),
    "an angle for no follower": lambda _: GENERATOR.default().observe(0.1),
    "an infinite angle": lambda samples: GENERATOR.read(samples / "follower.toml").follow([0.1, np.inf]),
    "a strike beyond the end": lambda samples: GENERATOR.read(samples / "follower.toml").follow([0.1], heel_strikes=[1]),
    "a folder": lambda samples: footfall.read(samples),
    "a table without time": lambda samples: footfall.fit(samples / "rows.csv"),
    "a joint that does not exist": lambda samples: footfall.read(samples / "walk.csv", columns={"left_toe": "x"}),
    "a rate of 0": lambda samples: footfall.read(samples / "walk.csv", rate_hz=0),
    "a unit without name": lambda samples: footfall.read(samples / "walk.csv", unit="furlong"),
    "a unit of a table": lambda samples: footfall.read(samples / "walk.csv").to_numpy(unit="turns"),
    "a filter without name": lambda samples: footfall.fit(samples / "walk.csv", low_pass="x"),
    "a filter of 0 Hz": lambda samples: footfall.fit(samples / "walk.csv", low_pass=0.0),
    "a kind without name": lambda samples: footfall.fit(samples / "walk.csv", kind="fourier"),
    "harmonics of a network": lambda samples: footfall.fit(samples / "walk.csv", kind="thesis", harmonics=3),
    "too many harmonics": lambda samples: footfall.fit(samples / "walk.csv", harmonics=9),
    "events of no follower": lambda samples: footfall.fit(samples / "walk.csv", events="peak"),
    "angles of another length": lambda _: footfall.Recording.of_arrays([0, 1], [[1.0]], ["left_hip"]),
    "a joint twice": lambda _: footfall.Recording.of_arrays([0, 1], np.zeros((2, 2)), ["left_hip", "left_hip"]),
    "times that are no numbers": lambda _: footfall.Recording.of_arrays([0, np.nan], np.zeros((2, 1)), ["left_hip"]),
    "a subject without name": lambda _: footfall.certify("x"),
    "no random start": lambda _: footfall.certify("walk", starts=0),
    "a code beyond 12 bits": lambda _: footfall.JointLoop().tick([5000], 1652),
    "five channels": lambda _: footfall.JointLoop().tick([1] * 5, 1652),
    "no control period": lambda _: footfall.JointLoop().tick([1], 1652, elapsed=0),
    "a fault without name": lambda _: footfall.JointLoop().tick([1], 1652, faults=["fire"]),
    "a request that is none": lambda _: footfall.JointLoop().tick([1], 1652, request="fly"),
    "columns of two lengths": lambda _: footfall.JointLoop().run([[1], [2]], [1652]),
    "a gait that no board has": lambda _: footfall.JointLoop(GENERATOR.gait("run")),
    "a chip without reference": lambda _: footfall.JointLoop(vrefint_cal=9),
    "a step of no end": lambda _: GENERATOR.default().step(10**30),
    "a count that is no number of 128 bits": lambda _: GENERATOR.default().step(-(10**60)),
    "a strike before the start": lambda samples: GENERATOR.read(samples / "follower.toml").follow([0.1], heel_strikes=[-1]),
    "a table to follow": lambda samples: GENERATOR.read(samples / "follower.toml").follow([[0.1]]),
    "no filter": lambda samples: footfall.fit(samples / "walk.csv", low_pass=None),  # type: ignore[arg-type]
    "a seed below 0": lambda samples: footfall.fit(samples / "walk.csv", seed=-1),
    "degrees that are said to be radians": lambda _: footfall.Recording.of_arrays([0, 1], [[1.0], [37.0]], ["left_hip"]),
    "angles of one dimension": lambda _: footfall.Recording.of_arrays([0, 1], [1.0, 2.0], ["left_hip"]),
    "times of two dimensions": lambda _: footfall.Recording.of_arrays([[0, 1]], [[1.0], [2.0]], ["left_hip"]),
    "times that are words": lambda _: footfall.Recording.of_arrays(["a", "b"], [[1.0], [2.0]], ["left_hip"]),
    "a table of angles for a sensor": lambda _: footfall.sensor_volts([[0.1]]),
    "targets of one dimension": lambda _: footfall.Gate().limit([0.0] * 4),
    "a row of targets that is shorter": lambda _: footfall.Gate().limit([[0.0] * 4, [0.0]]),
    "a code of the reference beyond 12 bits": lambda _: footfall.JointLoop(vrefint_cal=70_000),
    "a supply below 0": lambda _: footfall.JointLoop(min_supply_v=-1.0),
    "a supply of no chip": lambda _: footfall.JointLoop(min_supply_v=5.0),
    "a generator of another period": lambda _: footfall.JointLoop(GENERATOR.default(period_s=0.01)),
    "codes of no sensor": lambda _: footfall.JointLoop().tick([1, 1], 1652),
    "a capture that is none": lambda samples: footfall.read_capture(samples / "sensor.toml"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_values_are_value_errors(name: str, samples: Path) -> None:
    with pytest.raises(ValueError) as raised:
        WRONG[name](samples)
    assert isinstance(raised.value, footfall.InputError) and isinstance(raised.value, footfall.FootfallError)
    words = str(raised.value)
    assert any(word in words for word in ("allowed", "must be")), words


#: Wrong inputs of ``JointLoop.run`` with 4 rows, and what the error names.
WRONG_INPUTS: Dict[str, Dict[str, Any]] = {
    r"requests has row 4: .* below 4": {"requests": {4: "1 stop"}},
    r"requests has row -1: ": {"requests": {-1: "1 stop"}},
    r"request of row 3 = 'fly'": {"requests": {3: "fly"}},
    r"watchdog_hz has row 5: .* below 4": {"watchdog_hz": {5: 32_000}},
    r"watchdog_hz = -1: allowed is 0 to": {"watchdog_hz": {0: -1}},
    r"codes has the shape \(4, 2\): allowed is \(n, 1\)": {"codes": [[1, 2]] * 4},
    r"codes has the shape \(4, 0\): allowed is \(n, 1\)": {"codes": np.zeros((4, 0))},
    r"codes has the shape \(4,\): allowed is \(n, 1\)": {"codes": [1] * 4},
    r"codes\[2\] = 2048.9: ": {"codes": [[1], [2], [2048.9], [3]]},
    r"codes\[1\] = NaN: ": {"codes": [[1], [np.nan], [2], [3]]},
    r"codes\[0\] = 4096: allowed is a whole number from 0 to 4095": {"codes": [[4096]] * 4},
    r"codes holds <U1: allowed are numbers": {"codes": [["x"]] * 4},
    r"vrefint has the shape \(3,\): allowed is \(4,\)": {"vrefint": [1652] * 3},
    r"vrefint has the shape \(4, 1\): allowed is \(n,\)": {"vrefint": [[1652]] * 4},
    r"button\[1\] = NaN: ": {"button": [0, np.nan, 0, 0]},
    r"button holds <U2: allowed are numbers": {"button": ["no"] * 4},
    r"late has the shape \(2,\): allowed is \(4,\)": {"late": [True] * 2},
    r"fault_bits\[3\] = 32: allowed is a whole number from 0 to 31": {"fault_bits": [0, 0, 31, 32]},
    r"elapsed\[0\] = 0: allowed is a whole number from 1 to": {"elapsed": [0, 1, 1, 1]},
    r"debugger\[0\] = 3: allowed is a whole number from 0 to 2": {"debugger": [3, 0, 0, 0]},
}


@pytest.mark.parametrize("words", WRONG_INPUTS)
def test_no_input_of_the_loop_is_dropped(words: str) -> None:
    loop = footfall.JointLoop()
    with pytest.raises(footfall.InputError, match=words):
        loop.run(**{"codes": [[2048]] * 4, "vrefint": [1652] * 4, **WRONG_INPUTS[words]})
    assert loop.last.counters[0] == 0, "no tick was taken"
    loop.run([[2048.0]] * 4, [1652] * 4, button=[0, 1, 0, 1], fault_bits=[31] * 4, requests={3: "1 stop"}, watchdog_hz={0: 32_000})
    assert loop.last.counters[0] == 4


READERS: Dict[str, Callable[[Path], Any]] = {
    "recording": footfall.read,
    "generator": GENERATOR.read,
    "capture": footfall.read_capture,
    "robot": lambda path: footfall.certify("walk", robot=path),
    "sensor": lambda path: footfall.JointLoop(sensors=[("left_hip", path)]),
    "fit": footfall.fit,
}


@pytest.mark.parametrize("name", READERS)
def test_a_missing_file_is_an_os_error(name: str, tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="missing.csv: cannot be read"):
        READERS[name](tmp_path / "missing.csv")


def test_a_file_that_cannot_be_written_is_an_os_error(walk: footfall.Fit, tmp_path: Path) -> None:
    with pytest.raises(OSError, match="cannot be written"):
        walk.save(tmp_path / "no" / "folder.toml")


def test_errors_name_the_arguments_of_python(samples: Path) -> None:
    time_s = np.linspace(0.0, 10.0, 1000)
    unclear = np.radians(20.0 * np.sin(2.0 * np.pi * time_s))[:, np.newaxis] * np.ones(4)
    with pytest.raises(footfall.InputError, match=r"--knee-sign flexion.*\(arguments in Python: --knee-sign is knee_sign\)"):
        footfall.Recording.of_arrays(time_s, unclear * [1.0, -1.0, 1.0, -1.0], footfall.JOINTS).condition()


def test_a_refused_generator_is_saved_by_force_alone(samples: Path, tmp_path: Path) -> None:
    recording = footfall.read(samples / "walk.csv")
    wide = footfall.Recording.of_arrays(recording.time_s, 1.8 * recording.angles_rad, recording.joints)
    fit = footfall.fit(wide, starts=10)
    assert fit.not_used_because is not None
    with pytest.raises(footfall.FootfallError) as raised:
        fit.save(tmp_path / "generator.toml")
    words = str(raised.value)
    assert words.startswith(fit.not_used_because) and "fit_limits=True fits it into the limits, force=True writes it as it is" in words and not (tmp_path / "generator.toml").exists()
    fit.save(tmp_path / "generator.toml", force=True)
    assert (tmp_path / "generator.toml").read_text() == fit.to_toml()


def test_a_follower_with_a_history_is_not_pickled(samples: Path) -> None:
    import pickle

    follower = GENERATOR.read(samples / "follower.toml")
    follower.observe(0.1)
    with pytest.raises(footfall.FootfallError, match="reset"):
        pickle.dumps(follower)
    follower.reset()
    assert pickle.loads(pickle.dumps(follower)).follows == "left_hip"


def test_a_recording_of_no_gait_has_no_fit() -> None:
    time_s = np.arange(1000) * 0.01
    noise = np.random.default_rng(1).normal(size=(1000, 4)) * 0.2
    with pytest.raises(footfall.InputError):
        footfall.fit(footfall.Recording.of_arrays(time_s, noise, footfall.JOINTS))

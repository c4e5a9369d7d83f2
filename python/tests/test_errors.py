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
    "a capture that is none": lambda samples: footfall.read_capture(samples / "sensor.toml"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_values_are_value_errors(name: str, samples: Path) -> None:
    with pytest.raises(ValueError) as raised:
        WRONG[name](samples)
    assert isinstance(raised.value, footfall.InputError) and isinstance(raised.value, footfall.FootfallError)
    words = str(raised.value)
    assert any(word in words for word in ("allowed", "must be")), words


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

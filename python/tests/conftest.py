"""Fixtures of the tests: the samples of the repository, and runs that several tests use."""

from pathlib import Path
from typing import List, Tuple

import numpy as np
import numpy.typing as npt
import pytest

import footfall

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def samples() -> Path:
    """The folder of the samples."""
    return ROOT / "samples"


@pytest.fixture(scope="session")
def walk(samples: Path) -> footfall.Fit:
    """The sample recording, fitted with the least number of random starts."""
    return footfall.fit(samples / "walk.csv", starts=10)


Inputs = Tuple[npt.NDArray[np.uint16], npt.NDArray[np.uint16], npt.NDArray[np.bool_], npt.NDArray[np.uint8]]


@pytest.fixture(scope="session")
def armed() -> Inputs:
    """Codes, reference, button and faults of 6 s in which the emergency stop is tested, and then a hold of the button arms."""
    count = 6000
    time_s = np.arange(count) * 1e-3
    codes = np.round(2048 + 300 * np.sin(2 * np.pi * time_s / 1.1)).astype(np.uint16)[:, np.newaxis]
    button = np.zeros(count, dtype=np.bool_)
    button[100:700] = True
    faults = np.zeros(count, dtype=np.uint8)
    faults[25:50] = 1 << 1
    return codes, np.full(count, 1652, dtype=np.uint16), button, faults


def setpoint_hash(ticks: footfall.Ticks) -> List[int]:
    """The hash of setpoints, computed here from its definition: over tick, state and setpoints as words of 32 bits."""
    states = ["boot", "disarmed", "arming", "walking", "stopping", "fault", "trim_ready", "trimming"]
    value, values = 0xCBF29CE484222325, []
    for tick, state, setpoints in zip(ticks.tick, ticks.state, ticks.setpoints_rad):
        for word in [int(tick), states.index(str(state)), *map(int, setpoints.astype("<f4").view("<u4"))]:
            value = ((value ^ word) * 0x100000001B3) % 2**64
        values.append(value)
    return values

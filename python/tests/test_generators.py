"""Generators: every kind, shapes, units, pickling, followers."""

import concurrent.futures
import math
import multiprocessing
import pickle
from pathlib import Path

import numpy as np
import pytest

import footfall

DEFAULTS = {"phase-coupled": 4, "thesis": 4, "thesis-double": 4, "six-joints": 6, "eight-joints": 8}


@pytest.mark.parametrize("name,joints", DEFAULTS.items())
def test_every_default_has_its_shapes(name: str, joints: int) -> None:
    generator = footfall.Generator.default(name)
    motion = generator.run(3.0)
    assert motion.angles_rad.shape == motion.rates_rad_s.shape == (3000, joints)
    assert motion.time_s.shape == motion.phase_cycles.shape == (3000,)
    assert len(motion.joints) == len(generator.joints) == joints
    assert motion.angles_rad.dtype == np.float32 and motion.time_s.dtype == np.float64
    assert 0.001 == pytest.approx(motion.time_s[0]) and 3.0 == pytest.approx(generator.time_s)
    assert generator.angles_rad.tolist() == motion.angles_rad[-1].tolist()
    generator.check()


@pytest.mark.parametrize("name", footfall.gaits())
def test_every_gait_has_its_stride(name: str) -> None:
    about = footfall.gaits()[name]
    motion = footfall.Generator.gait(name).run(12.0)
    # The phase wraps once a stride.
    strides = np.diff(motion.time_s[1:][np.diff(motion.phase_cycles) < -0.5])
    assert strides[-1] == pytest.approx(about["stride_s"], abs=0.025)


def test_rates_are_the_derivatives_of_the_angles() -> None:
    motion = footfall.Generator.gait("natural-walk").run(2.2)
    centred = (motion.angles_rad[2:].astype(float) - motion.angles_rad[:-2]) / 0.002
    assert np.abs(centred - motion.rates_rad_s[1:-1]).max() < 0.02
    assert np.abs(motion.rates_rad_s).max() > 3.0


def test_angles_are_radians(samples: Path) -> None:
    """The knees of the default walk bend by -2 to 62 degrees."""
    knees = footfall.Generator.default().run(10.0).angles_rad[5000:, 2:]
    assert -4.0 < math.degrees(knees.min()) < 0.0 and 60.0 < math.degrees(knees.max()) < 64.0


def test_runs_continue_and_every_leaves_rows_out() -> None:
    whole, parts = footfall.Generator.default().run(2.0), footfall.Generator.default()
    first, second = parts.run(0.5), parts.run(1.5, every=5)
    assert first.angles_rad.tolist() == whole.angles_rad[:500].tolist()
    assert second.angles_rad.tolist() == whole.angles_rad[504::5].tolist()
    np.testing.assert_allclose(second.time_s, whole.time_s[504::5])
    parts.reset()
    parts.step(500)
    assert parts.angles_rad.tolist() == first.angles_rad[-1].tolist()


def test_a_file_gives_the_generator_that_wrote_it(samples: Path, tmp_path: Path) -> None:
    read = footfall.Generator.read(samples / "generator.toml")
    parsed = footfall.Generator.parse((samples / "generator.toml").read_text())
    assert read.kind == parsed.kind == "shape"
    assert read.run(1.0).angles_rad.tolist() == parsed.run(1.0).angles_rad.tolist()
    again = footfall.Generator.parse(read.to_toml())
    assert again.run(1.0).angles_rad.tolist() == footfall.Generator.read(samples / "generator.toml").run(1.0).angles_rad.tolist()


def _angles(generator: footfall.Generator) -> "list[float]":
    generator.step(100)
    return [float(angle) for angle in generator.angles_rad]


def test_generators_go_to_other_processes_with_their_state() -> None:
    makers = [lambda: footfall.Generator.default("thesis"), lambda: footfall.Generator.gait("run", speed=1.2)]
    for make in makers:
        here = make()
        here.step(1234)
        again = pickle.loads(pickle.dumps(here))
        assert again.time_s == here.time_s and again.angles_rad.tolist() == here.angles_rad.tolist()
        context = multiprocessing.get_context("spawn")
        with concurrent.futures.ProcessPoolExecutor(1, mp_context=context) as pool:
            assert pool.submit(_angles, here).result() == _angles(here)


def person(strides_of_s: float, seconds: float, fit: footfall.Fit) -> "np.ndarray":  # type: ignore[type-arg]
    """The left hip of the fitted mean stride, walked at another cadence; rad, one sample a millisecond."""
    time_s = np.arange(round(seconds * 1000)) * 1e-3
    points = np.arange(201) / 200
    hip = np.append(fit.mean_stride_rad[:, 0], fit.mean_stride_rad[0, 0])
    return np.interp(time_s / strides_of_s % 1.0, points, hip)


def test_a_follower_finds_the_stride_of_the_person(samples: Path) -> None:
    fit = footfall.fit(samples / "walk.csv", follow="left_hip", starts=10)
    follower = fit.generator()
    assert follower.follows == "left_hip"
    following = follower.follow(person(1.2, 15.0, fit))
    assert following.angles_rad.shape == (15000, 4) and following.phase_cycles.shape == (15000,)
    assert following.locked[8000:].all() and not following.locked[0]
    np.testing.assert_allclose(following.stride_s[10000:], 1.2, rtol=0.01)
    np.testing.assert_allclose(following.frequency_hz[10000:], 1 / 1.2, rtol=0.01)
    # The phase advances by a cycle a stride.
    assert np.unwrap(following.phase_cycles[9000:], period=1.0)[[0, 4800]] @ [-1, 1] == pytest.approx(4.0, abs=0.05)


def test_a_lost_sensor_is_held_and_named(samples: Path) -> None:
    fit = footfall.fit(samples / "walk.csv", follow="left_hip", starts=10)
    angles = person(1.1, 14.0, fit)
    angles[10_000:11_000] = np.nan
    following = fit.generator().follow(angles)
    assert following.state[9_990] == "locked" and following.state[10_900] == "holding"
    assert following.fault[9_990] == "" and following.fault[10_900] == "missing"


def test_one_sample_at_a_time_is_the_same(samples: Path) -> None:
    follower, other = (footfall.Generator.read(samples / "follower.toml") for _ in range(2))
    angles = 0.1 + 0.35 * np.cos(2 * np.pi * np.arange(3000) / 1100)
    following = follower.follow(angles)
    for angle in angles:
        other.observe(float(angle))
        other.step()
    status = other.follow_status
    assert status is not None and status.stride_s == following.stride_s[-1] and status.state == following.state[-1]
    assert other.angles_rad.tolist() == following.angles_rad[-1].tolist()

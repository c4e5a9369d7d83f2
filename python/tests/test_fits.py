"""Fits and certificates: errors on held-out strides, reasons as data."""

from pathlib import Path

import numpy as np
import pytest

import footfall


def test_the_error_is_that_of_the_curves(walk: footfall.Fit) -> None:
    """Computed again by numpy from the two curves."""
    apart = np.degrees(walk.generator_stride_rad - walk.mean_stride_rad)
    assert apart.shape == (200, 4)
    np.testing.assert_allclose(walk.rmse_deg, np.sqrt((apart**2).mean(axis=0)), rtol=1e-6)
    np.testing.assert_allclose(walk.mean_stride_rad, walk.strides_rad.mean(axis=0), atol=1e-12)
    spread = np.degrees(walk.strides_rad - walk.mean_stride_rad)
    np.testing.assert_allclose(walk.stride_sd_deg, np.sqrt((spread**2).mean(axis=(0, 1))), rtol=1e-6)


def test_held_out_errors_are_near_their_floor(walk: footfall.Fit) -> None:
    heldout, floor = walk.heldout_rmse_deg, walk.heldout_floor_deg
    assert heldout is not None and floor is not None and heldout.shape == (4,)
    second = walk.strides_rad[len(walk.strides_rad) // 2 :]
    own = walk.strides_rad[: len(walk.strides_rad) // 2].mean(axis=0)
    np.testing.assert_allclose(floor, np.degrees(np.sqrt(((second - own) ** 2).mean(axis=(0, 1)))), rtol=1e-6)
    assert (heldout < floor * 1.1).all() and "second" in walk.held_out


def test_the_generator_plays_the_fitted_stride(walk: footfall.Fit) -> None:
    generator = walk.generator()
    motion = generator.run(2.0 * walk.stride_s)
    played = [np.interp(np.arange(200) / 200, *folded(motion.phase_cycles, motion.angles_rad[:, joint])) for joint in range(4)]
    # The phase of the two curves may differ by a shift.
    shifts = [np.abs(np.roll(np.array(played).T, shift, axis=0) - walk.generator_stride_rad).max() for shift in range(200)]
    assert min(shifts) < np.radians(1.0)


def folded(phase: "np.ndarray", angles: "np.ndarray") -> "tuple[np.ndarray, np.ndarray]":  # type: ignore[type-arg]
    order = np.argsort(phase)
    return phase[order], angles[order].astype(float)


def test_a_fit_can_be_saved_and_read(walk: footfall.Fit, tmp_path: Path) -> None:
    walk.save(tmp_path / "walk.toml")
    read = footfall.Generator.read(tmp_path / "walk.toml")
    assert read.run(1.0).angles_rad.tolist() == walk.generator().run(1.0).angles_rad.tolist()
    assert walk.report().startswith("<!DOCTYPE html>") or "<html" in walk.report()[:200]


def test_the_same_data_from_arrays_give_the_same_fit(samples: Path, walk: footfall.Fit) -> None:
    recording = footfall.read(samples / "walk.csv")
    arrays = footfall.Recording.of_arrays(recording.time_s, np.degrees(recording.angles_rad), recording.joints, unit="deg")
    np.testing.assert_allclose(footfall.fit(arrays, starts=10).rmse_deg, walk.rmse_deg, atol=1e-4)


def test_a_refusal_has_reasons_as_data() -> None:
    certificate = footfall.certify("human-run-unscaled", starts=5)
    assert certificate.status == "beyond_limits" and certificate.walks is True
    (reason,) = certificate.reasons
    assert reason.status == "beyond_limits" and "left_knee" in reason.because and "deg/s" in reason.because
    excess = certificate.as_dict()["excesses"][0]
    assert excess["of"] == "left_knee" and excess["value"] > excess["allowed"] == pytest.approx(500.0)
    with pytest.raises(TypeError, match="neither true nor false"):
        bool(certificate)


def test_a_network_of_six_joints_is_certified() -> None:
    certificate = footfall.certify(footfall.Generator.default("six-joints"), starts=20)
    assert certificate.status == "accepted" and certificate.reasons == [] and certificate.walks is None
    assert certificate.period_s == pytest.approx(1.1, abs=0.01)

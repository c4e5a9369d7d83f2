"""Recordings: reading, repair, arrays, tables."""

import warnings
from pathlib import Path

import numpy as np
import pytest

import footfall


@pytest.mark.parametrize("name,rows", [("walk.csv", 4000), ("walk.mot", 1200), ("walk.c3d", 1200)])
def test_a_recording_has_its_shape(samples: Path, name: str, rows: int) -> None:
    recording = footfall.read(samples / name)
    assert recording.angles_rad.shape == (rows, 4) and recording.time_s.shape == (rows,)
    assert recording.joints == footfall.JOINTS


def test_angles_are_those_of_the_file_in_radians(samples: Path) -> None:
    """Read again by numpy alone."""
    table = np.genfromtxt(samples / "walk.csv", delimiter=",", names=True)
    recording = footfall.read(samples / "walk.csv")
    np.testing.assert_array_equal(recording.time_s, table["time_s"])
    for column, joint in enumerate(recording.joints):
        np.testing.assert_allclose(recording.angles_rad[:, column], np.radians(table[f"{joint}_deg"]), rtol=1e-14)
        np.testing.assert_allclose(recording.to_numpy(unit="deg")[f"{joint}_deg"], table[f"{joint}_deg"], rtol=1e-13)
        np.testing.assert_array_equal(recording.to_numpy()[f"{joint}_rad"], recording.angles_rad[:, column])


def test_a_frame_has_units_in_its_columns(samples: Path) -> None:
    pytest.importorskip("pandas")
    frame = footfall.read(samples / "walk.csv").to_pandas(unit="deg")
    assert list(frame.columns) == [f"{joint}_deg" for joint in footfall.JOINTS] and frame.index.name == "time_s"
    assert 50.0 < float(frame["left_knee_deg"].max()) < 80.0


def test_conditioning_says_what_it_did(samples: Path) -> None:
    recording = footfall.read(samples / "walk.csv")
    angles = recording.angles_rad.copy()
    angles[500:505, 2] += np.radians(25.0)  # As of swapped markers.
    angles[800:803, 0] = np.nan
    damaged = footfall.Recording.of_arrays(recording.time_s, angles, recording.joints)
    repaired = damaged.condition()
    assert any("jump" in finding.text and finding.joint == "left_knee" for finding in repaired.findings)
    assert np.isfinite(repaired.angles_rad).all() and repaired.rate_hz == pytest.approx(100.0)
    assert np.abs(repaired.angles_rad - recording.angles_rad).max() < np.radians(6.0)


def test_a_doubtful_recording_warns(samples: Path) -> None:
    recording = footfall.read(samples / "walk.csv")
    angles = recording.angles_rad.copy()
    angles[:, 0] = 0.2  # A hip that does not move.
    with warnings.catch_warnings(record=True) as issued:
        warnings.simplefilter("always")
        footfall.Recording.of_arrays(recording.time_s, angles, recording.joints).condition()
    assert any(warning.category is footfall.RecordingWarning and "left hip" in str(warning.message) for warning in issued)


def test_the_sign_of_the_hips_may_be_named(samples: Path) -> None:
    recording = footfall.read(samples / "walk.csv")
    mirrored = footfall.Recording.of_arrays(recording.time_s, recording.angles_rad * [-1.0, -1.0, 1.0, 1.0], recording.joints)
    with pytest.warns(footfall.RecordingWarning, match="by the shape of the strides"):
        turned = mirrored.condition()
    np.testing.assert_allclose(turned.angles_rad, recording.condition().angles_rad, rtol=1e-12)
    assert any("(arguments in Python: --hip-sign is hip_sign)" in finding.text for finding in turned.findings)
    assert sum(finding.level == "warning" for finding in turned.findings) == 2, "a guess that changes the data"
    assert turned.signs == {"left_hip": "turned", "right_hip": "turned", "left_knee": "known", "right_knee": "known"}
    kept = mirrored.condition(hip_sign="flexion")
    assert kept.signs["left_hip"] == "named" and not any(finding.level == "warning" for finding in kept.findings)
    np.testing.assert_allclose(kept.angles_rad[:, :2], -recording.angles_rad[:, :2], rtol=1e-12)
    assert any("as requested" in finding.text and finding.level == "note" for finding in kept.findings)
    with pytest.raises(footfall.InputError, match="hip_sign = 'up': allowed is one of flexion, extension"):
        mirrored.condition(hip_sign="up")


def test_a_sign_that_nothing_shows_is_assumed_with_a_warning(samples: Path) -> None:
    recording = footfall.read(samples / "walk.csv")
    short = footfall.Recording.of_arrays(recording.time_s[:60], recording.angles_rad[:60], recording.joints)
    with pytest.warns(footfall.RecordingWarning, match="hip_sign"):
        assumed = short.condition()
    assert assumed.signs["left_hip"] == "assumed"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert short.condition(hip_sign="extension").signs["right_hip"] == "named"


def test_volts_are_read_through_a_calibration(samples: Path) -> None:
    knee = footfall.read(samples / "oscilloscope.csv", columns={"left_knee": "CH1"}, calibration=samples / "sensor.toml")
    assert knee.joints == ["left_knee"] and knee.angles_rad.shape[1] == 1
    assert np.radians(50.0) < knee.angles_rad.max() < np.radians(80.0)

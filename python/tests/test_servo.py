"""Servos under load, servo maps and sensors: closed forms and the files of the samples."""

import math
from pathlib import Path
from typing import Any, Callable, Dict

import numpy as np
import pytest

import footfall


def test_a_servo_has_the_numbers_of_its_data_sheet() -> None:
    servo = footfall.Servo("MG996R", supply_v=6.0)
    assert servo.stall_nm == pytest.approx(11.0 * 0.0980665) and servo.no_load_rad_s == pytest.approx(math.radians(60.0) / 0.14)
    assert servo.torque(0.0, 0.0, 0.0) == 0.0, "no pulse yet"
    servo.pulse(0.0, 2000.0)
    assert servo.torque(0.0, 0.0, 0.0) == pytest.approx(servo.stall_nm)
    assert servo.torque(0.0, 0.0, servo.no_load_rad_s) == pytest.approx(0.0, abs=1e-12)
    # 1500 us are the angle 0, 1000 us a quarter of a turn and half of it the angle of 2000 us.
    assert servo.torque(0.0, math.pi / 4, 0.0) == pytest.approx(0.0, abs=1e-9)
    assert servo.torque(0.06, 0.0, 0.0) == 0.0, "an analogue servo has relaxed"
    servo.set_supply(0.0)
    assert servo.stall_nm == 0.0 and servo.torque(0.0, 0.0, 1.0) == 0.0


def test_the_torque_rises_with_the_supply() -> None:
    stall = [footfall.Servo("DS3225", supply_v=volts).stall_nm for volts in (5.0, 5.5, 6.0, 6.8)]
    assert stall == sorted(stall) and len(set(stall)) == 4
    assert footfall.Servo("DS3225", supply_v=6.0, stall_factor=0.9).stall_nm == pytest.approx(0.9 * stall[2])


def pulses_at(*times_s: float) -> footfall.Servo:
    servo = footfall.Servo("SG90", supply_v=5.0)
    for time_s in times_s:
        servo.pulse(time_s, 1600.0)
    return servo


def test_a_servo_without_supply_forgets_the_time_of_its_pulse() -> None:
    servo = pulses_at(1.0, 1.0, 1.02)
    servo.set_supply(0.0)
    servo.set_supply(5.0)
    servo.pulse(0.0, 1600.0)
    assert servo.torque(0.0, 0.0, 0.0) > 0.0


WRONG: Dict[str, Callable[[], Any]] = {
    "a servo without name": lambda: footfall.Servo("x", supply_v=6.0),
    "a supply beyond the data sheet": lambda: footfall.Servo("MG996R", supply_v=7.4),
    "a supply that is no number": lambda: footfall.Servo("MG996R", supply_v=math.nan),
    "a scale of 0": lambda: footfall.Servo("SG90", supply_v=5.0, us_per_rad=0.0),
    "a band of 0": lambda: footfall.Servo("SG90", supply_v=5.0, band_deg=0.0),
    "a torque at an angle that is no number": lambda: footfall.Servo("SG90", supply_v=5.0).torque(0.0, math.nan, 0.0),
    "a torque at no time": lambda: footfall.Servo("SG90", supply_v=5.0).torque(math.inf, 0.0, 0.0),
    "a torque at an infinite speed": lambda: footfall.Servo("SG90", supply_v=5.0).torque(0.0, 0.0, -math.inf),
    "a pulse at no time": lambda: footfall.Servo("SG90", supply_v=5.0).pulse(math.nan, 1500.0),
    "a pulse of no width": lambda: footfall.Servo("SG90", supply_v=5.0).pulse(0.0, math.nan),
    "a pulse before the last": lambda: pulses_at(1.0, 0.98),
    "an angle that is no number": lambda: footfall.sensor_volts([math.nan]),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_values_say_what_is_allowed(name: str) -> None:
    with pytest.raises(footfall.InputError, match="allowed"):
        WRONG[name]()


def test_the_servo_map_is_that_of_the_control_loop(samples: Path) -> None:
    maps = footfall.robot()
    park = [one["neutral_us"] + one["us_per_rad"] * (one["park_rad"] - one["at_neutral_rad"]) for one in maps.values()]
    assert list(maps) == footfall.JOINTS and np.round(park).tolist() == [1500, 1500, 1056, 1944]
    assert footfall.robot(samples / "robot.toml") != maps
    with pytest.raises(FileNotFoundError):
        footfall.robot("missing.toml")


def test_volts_are_those_of_the_sensor_file(samples: Path) -> None:
    # Points of samples/sensor.toml.
    volts = footfall.sensor_volts(np.radians([-40.0, 0.0, 60.0, 130.0, 170.0]), calibration=samples / "sensor.toml")
    np.testing.assert_allclose(volts, [0.35, 0.9334, 1.7462, 2.6, 2.6], atol=1e-5)
    assert np.all(np.diff(footfall.sensor_volts(np.radians(np.arange(-10.0, 80.0)))) > 0.0)

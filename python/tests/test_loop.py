"""The control loop: arming, the hash of the setpoints, one tick and many ticks."""

from pathlib import Path

import numpy as np
import pytest

import footfall
from conftest import Inputs, setpoint_hash


def test_the_loop_arms_walks_and_hashes(armed: Inputs) -> None:
    codes, vrefint, button, faults = armed
    loop = footfall.JointLoop()
    assert loop.awaits_stop_test and loop.channels == 1
    ticks = loop.run(codes, vrefint, button=button, fault_bits=faults, watchdog_hz={0: 32_000})
    assert ticks.state[0] == "disarmed" and ticks.state[-1] == "walking" and loop.state == "walking"
    assert not loop.awaits_stop_test
    # The first pulses are those of the park pose: 1500 us at the hips, 5 degrees at the knees.
    first = int(np.argmax(ticks.pulses_us[:, 0] > 0))
    assert ticks.pulses_us[first].tolist() == [1500, 1500, 1056, 1944]
    moving = np.isin(ticks.state, ["arming", "walking", "stopping"])
    np.testing.assert_array_equal(ticks.pulses_us[:, 0] > 0, moving)
    # Half a turn of the servo, 636.62 us/rad, about 1500 us.
    np.testing.assert_allclose(ticks.pulses_us[moving, 0], 1500 + 636.62 * ticks.setpoints_rad[moving, 0], atol=0.51)


def test_the_hash_is_that_of_its_definition(armed: Inputs) -> None:
    codes, vrefint, button, faults = armed
    ticks = footfall.JointLoop().run(codes, vrefint, button=button, fault_bits=faults, watchdog_hz={0: 32_000})
    assert ticks.setpoint_hash.tolist() == setpoint_hash(ticks)
    other = footfall.JointLoop(footfall.Generator.default("thesis")).run(codes, vrefint, button=button, fault_bits=faults, watchdog_hz={0: 32_000})
    assert other.setpoint_hash[-1] != ticks.setpoint_hash[-1]


def test_one_tick_at_a_time_is_the_same(armed: Inputs) -> None:
    codes, vrefint, button, faults = (column[:1500] for column in armed)
    many, one = footfall.JointLoop(), footfall.JointLoop()
    ticks = many.run(codes, vrefint, button=button, fault_bits=faults, watchdog_hz={0: 32_000})
    for row in range(1500):
        names = ["break_input"] if faults[row] else []
        tick = one.tick(codes[row].tolist(), int(vrefint[row]), button=bool(button[row]), faults=names, watchdog_hz=None if row else 32_000)
        assert tick.setpoint_hash == ticks.setpoint_hash[row] and tick.state == ticks.state[row]
    assert tick.setpoints_rad.tolist() == ticks.setpoints_rad[-1].tolist() and one.setpoint_hash == many.setpoint_hash


def test_a_broken_wire_stops_the_walk(armed: Inputs) -> None:
    codes, vrefint, button, faults = armed
    codes = codes.copy()
    codes[5000:] = 4095
    ticks = footfall.JointLoop().run(codes, vrefint, button=button, fault_bits=faults, watchdog_hz={0: 32_000})
    assert ticks.state[4999] == "walking" and "stopping" in ticks.state[5000:] and ticks.state[-1] == "disarmed"
    assert ticks.cause[-1].startswith("sensor_") and ticks.validity[5100, 0] not in ("good", "")


def test_requests_and_missed_periods_are_taken(armed: Inputs) -> None:
    codes, vrefint, button, faults = armed
    elapsed = np.ones(len(codes), dtype=np.int64)
    elapsed[3000] = 3
    ticks = footfall.JointLoop().run(
        codes, vrefint, button=button, fault_bits=faults, watchdog_hz={0: 32_000}, elapsed=elapsed, requests={5500: "1 stop"}
    )
    assert ticks.tick[3000] - ticks.tick[2999] == 3
    assert ticks.state[5499] == "walking" and ticks.state[5500] == "stopping" and ticks.cause[5500] == "request"


def test_sensors_and_robot_of_files(samples: Path, armed: Inputs) -> None:
    pair = [("left_hip", samples / "sensor.toml"), ("left_knee", None)]
    codes, vrefint, button, faults = armed
    # 3.3 V: the least supply of this robot is above 2.7 V.
    ticks = footfall.JointLoop(robot=samples / "robot.toml").run(codes, vrefint * 0 + 1502, button=button, fault_bits=faults, watchdog_hz={0: 32_000})
    assert ticks.state[-1] == "walking"
    first = ticks.pulses_us[int(np.argmax(ticks.pulses_us[:, 0] > 0))]
    assert first.tolist() != [1500, 1500, 1056, 1944] and (first > 500).all()
    loop = footfall.JointLoop(footfall.Generator.read(samples / "follower.toml"), sensors=pair, min_supply_v=3.0)
    assert loop.channels == 2
    tick = loop.tick([2048, 2048], 1502)
    assert tick.validity[2:] == ["", ""] and tick.validity[1] == "good" and tick.follow_status is not None


def test_the_gate_holds_what_the_loop_gives_and_limits_a_step(armed: Inputs) -> None:
    codes, vrefint, button, faults = armed
    ticks = footfall.JointLoop().run(codes, vrefint, button=button, fault_bits=faults, watchdog_hz={0: 32_000})
    walking = ticks.setpoints_rad[ticks.pulses_us[:, 0] > 0]
    setpoints, limited = footfall.Gate().limit(walking)
    # What has passed the gate passes it again, bit for bit.
    assert np.array_equal(setpoints, walking) and not limited.any() and np.ptp(setpoints[:, 0]) > 0.3
    one, park = footfall.robot()["left_hip"], np.array([joint["park_rad"] for joint in footfall.robot().values()])
    targets = np.tile(park, (1000, 1))
    # Beyond the range.
    targets[:, 0] = one["most_rad"] + 1.0
    gate = footfall.Gate()
    parts = [gate.limit(targets[:100]), gate.limit(targets[100:])]
    moved, bits = (np.concatenate(column) for column in zip(*parts))
    # The limits of `footfall defaults robot`: 500 degrees a second, 20,000 degrees a second squared.
    rates = np.diff(np.degrees(moved[:, 0].astype(np.float64)), prepend=np.degrees(park[0])) * 1000.0
    assert rates.max() == pytest.approx(500.0, abs=0.1) and np.abs(np.diff(rates, prepend=0.0)).max() == pytest.approx(20.0, abs=0.1)
    assert moved[-1, 0] == pytest.approx(one["most_rad"], abs=1e-6) and moved[:, 0].max() <= one["most_rad"]
    assert bits[0] == 0b1001 and 0b0101 in bits and bits[-1] == 0b0001, "range, with acceleration, with rate, at rest"
    np.testing.assert_allclose(moved[:, 1:], np.broadcast_to(park[1:], (1000, 3)), atol=1e-6)
    for wrong in (targets[:, :3], np.full((1, 4), np.nan)):
        with pytest.raises(footfall.InputError, match="allowed"):
            gate.limit(wrong)

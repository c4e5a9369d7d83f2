"""A leg that swings, and the flashed image that follows it: leg.py FIRMWARE.elf ROBOT.bin FOLLOWER.bin SENSORS.bin SENSOR.toml PICTURE.png

The leg is a pendulum that its owner drives with a torque of 0.9 Hz. A goniometer at the hip gives the board its volts; the board's follower drives the
servo of the robot's hip, and a spring joins that to the leg: what the board does changes what it measures. Nothing of the leg was measured on a person.

    footfall defaults robot > robot.toml && footfall pack --robot robot.toml -o robot.bin
    footfall pack samples/follower.toml -o follower.bin
    footfall defaults sensor > sensor.toml && footfall pack --sensor left_hip=sensor.toml -o sensors.bin
"""

import math
import re
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

import footfall

#: A step of the simulation, s.
STEP_S = 0.002
#: Natural frequency of the leg, rad/s; its damping, 1/s; the angle about which it swings, rad.
NATURAL_RAD_S, DAMPING_1_S, MEAN_RAD = 2.0 * math.pi * 0.85, 1.2, math.radians(9.4)
#: The owner's torque over the leg's moment of inertia, rad/s^2, and its frequency, Hz.
DRIVE_RAD_S2, DRIVE_HZ = 3.4, 0.9
#: Spring from the servo to the leg over the same, 1/s^2.
SPRING_1_S2 = 6.0


class Leg:
    """A driven pendulum: angle in rad, rate in rad/s."""

    def __init__(self, sensor: str) -> None:
        points = re.findall(r"sensor_v *= *([-\d.]+),?\s*angle_deg *= *([-\d.]+)", Path(sensor).read_text(encoding="utf-8"))
        self.table = np.array(points, dtype=np.float64)
        self.time_s, self.rad, self.rad_s = 0.0, MEAN_RAD + math.radians(20.0), 0.0

    def volts(self) -> float:
        """What the goniometer gives, V, by its calibration."""
        return float(np.interp(math.degrees(self.rad), self.table[:, 1], self.table[:, 0]))

    def swing(self, servo_rad: float, is_driven: bool) -> None:
        """Moves on by a step, beside a servo at this angle, rad, whose spring pulls while the servo has torque."""
        from_mean = self.rad - MEAN_RAD
        pull = SPRING_1_S2 * (servo_rad - self.rad) if is_driven else 0.0
        drive = DRIVE_RAD_S2 * math.cos(2.0 * math.pi * DRIVE_HZ * self.time_s)
        self.rad_s += STEP_S * (pull + drive - DAMPING_1_S * self.rad_s - NATURAL_RAD_S**2 * math.sin(from_mean))
        self.rad += STEP_S * self.rad_s
        self.time_s += STEP_S


def main(elf: str, robot: str, follower: str, sensors: str, sensor: str, picture: str) -> None:
    """Runs for some seconds, prints how far the joint is from the leg, in degrees, and draws both."""
    leg, alone, rows = Leg(sensor), Leg(sensor), []

    def body(step: footfall.Step) -> "list[list[float]]":
        """Takes a step of the board, and returns the volts of the next one, at its beginning and its end."""
        assert step.servo_rad is not None
        hip = float(step.servo_rad[footfall.JOINTS.index("left_hip")])
        rows.append((step.time_s, leg.rad, hip, alone.rad))
        first = leg.volts()
        leg.swing(hip, step.rail)
        alone.swing(0.0, False)
        return [[first], [leg.volts()]]

    with footfall.VirtualBoard(elf, robot=robot, generator=follower, sensors=sensors, servo="digital", servo_at_deg=[0, 0, 5, 5]) as board:
        step = board.arm(body, step_s=STEP_S)
        armed_s = step.time_s
        while board.time_s < 10.0:
            step = board.step(STEP_S, body(step))
    time_s, leg_rad, hip_rad, alone_rad = np.array(rows, dtype=np.float64).T
    walk = time_s > time_s[-1] - 3.0
    swing = float(np.degrees(np.ptp(leg_rad[walk])))
    from_alone, from_hip = (math.sqrt(float(np.mean(np.degrees(leg_rad - other)[walk] ** 2))) for other in (alone_rad, hip_rad))
    print(f"armed at {armed_s:.3f} s")
    print(f"in the last 3 s the leg swings by {swing:.1f} degrees, {from_alone:.2f} degrees (RMS) from the leg without the robot")
    print(f"the hip of the robot is {from_hip:.2f} degrees (RMS) from the leg then")
    assert board.verdict is not None
    print(f"{board.verdict.pulses} pulses, {board.verdict.violations} of them not allowed")
    figure, panel = plt.subplots(figsize=(9, 4), layout="constrained")
    panel.plot(time_s, np.degrees(leg_rad), color="0.3", label="leg")
    panel.plot(time_s, np.degrees(alone_rad), ":", color="0.6", label="leg without the robot")
    panel.plot(time_s, np.degrees(hip_rad), color="C1", label="left hip of the robot")
    panel.axvline(armed_s, color="0.7", linewidth=0.8, label="armed")
    panel.set(xlabel="time, s", ylabel="angle, deg", title="a leg and the board that follows it (simulated)")
    figure.legend(loc="outside lower center", ncols=4)
    figure.savefig(picture, dpi=120)


if __name__ == "__main__":
    if len(sys.argv) != 7:
        sys.exit(__doc__)
    main(*sys.argv[1:])

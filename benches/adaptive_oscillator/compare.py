#!/usr/bin/env python3
"""Compares Footfall's entrainment with the Python package adaptive-oscillator 0.2.1; prints one table in Markdown.

    python3 -m venv venv && venv/bin/pip install adaptive-oscillator==0.2.1
    cargo build --profile host -p footfall --example entrain_stream
    venv/bin/python benches/adaptive_oscillator/compare.py target/host/examples/entrain_stream

Both get the same left hip angle: the mean of the two strides of the recording in tests/traces as a Fourier series of eight harmonics, at
a stride of 1.1 s that varies by 4 % over 10 s. The package runs at 100 Hz (1 kHz for the time of an update), with angles in radians and in
degrees, whichever gives the better result in a row; its phase is that of its first oscillator minus its mean difference to the person's
phase, because it defines no zero. Footfall runs at 1 kHz on the host; its phase zero is used as it is, except for the steady error, where
both are taken about their means.
"""
import csv
import math
import pathlib
import statistics
import subprocess
import sys
import time

import numpy as np
from loguru import logger

logger.remove()
from adaptive_oscillator.definitions import AOParameters  # noqa: E402
from adaptive_oscillator.oscillator import AdaptiveOscillator  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
STRIDE_S = 1.1
WALK_S = 30.0


def template():
    """Fourier series of the recorded left hip over its best period, phase 0 at its maximum: complex coefficients, degrees."""
    with open(ROOT / "tests/traces/gaitkit_fukuchi_healthy.csv", encoding="utf-8") as file:
        rows = [(float(row["time_s"]), float(row["left_hip_deg"])) for row in csv.DictReader(file)]
    times, angles = np.array(rows).T
    best = None
    for period in np.arange(1.0, 1.2, 0.0005):
        basis = np.stack([np.exp(2j * math.pi * n * times / period) for n in range(-8, 9)], axis=1)
        # Ridge: 2.3 strides leave the high harmonics weakly determined.
        normal = basis.conj().T @ basis + 0.5 * np.diag([n * n for n in range(-8, 9)])
        c = np.linalg.solve(normal, basis.conj().T @ angles)
        rest = float(np.sum(np.abs(angles - (basis @ c).real) ** 2))
        if best is None or rest < best[0]:
            best = (rest, c)
    c = best[1][8:]
    c[1:] *= 2
    cycles = np.arange(0, 1, 1e-4)
    at_maximum = cycles[np.argmax(value(c, cycles))]
    return np.array([c[n] * np.exp(2j * math.pi * n * at_maximum) for n in range(9)])


def value(c, cycles):
    return sum((c[n] * np.exp(2j * math.pi * n * np.asarray(cycles))).real for n in range(9))


def clock(seconds, rate, start=0.0, variation=0.04, stop=None):
    """The person's phase in cycles; decelerates to a stop within 0.2 s from `stop` on."""
    t = np.arange(int(seconds * rate)) / rate
    speed = (1 + variation * np.sin(2 * math.pi * t / 10)) / STRIDE_S
    if stop is not None:
        speed *= np.clip(1 - (t - stop) / 0.2, 0, 1)
    return start + np.cumsum(speed) / rate


def ours(program, angles, stride_s):
    text = "\n".join("nan" if math.isnan(a) else f"{a:.4f}" for a in angles)
    done = subprocess.run([program, str(stride_s)], input=text, capture_output=True, text=True, check=True, timeout=120)
    rows = [line.split() for line in done.stdout.splitlines()]
    columns = {
        "estimate": np.array([float(row[0]) for row in rows]),
        "driven": np.array([float(row[1]) for row in rows]),
        "frequency": np.array([float(row[2]) for row in rows]),
        "amplitude": np.array([float(row[3]) for row in rows]),
        "state": [row[4] for row in rows],
    }
    return columns, float(done.stderr)


def theirs(angles, rate, stride_s, scale):
    oscillator = AdaptiveOscillator(AOParameters(omega_init=2 * math.pi / stride_s))
    phase, frequency = [], []
    for n, angle in enumerate(angles):
        oscillator.update((n + 1) / rate, angle * scale)
        phase.append(oscillator.phi[0] / (2 * math.pi))
        frequency.append(oscillator.omega / (2 * math.pi))
    return np.array(phase), np.array(frequency)


def wrapped(cycles):
    return (np.asarray(cycles) + 0.5) % 1.0 - 0.5


def centred(off):
    """Differences minus their circular mean, and the mean."""
    mean = np.angle(np.mean(np.exp(2j * math.pi * np.asarray(off)))) / (2 * math.pi)
    return wrapped(off - mean), mean


def lock_time(off, slow, rate):
    bad = np.flatnonzero((np.abs(off) > 0.05) | (np.abs(slow) > 0.03))
    return (bad[-1] + 1) / rate if len(bad) else 0.0


def seconds(values, limit):
    late = sum(v > limit - 0.5 for v in values)
    text = f"{statistics.median(values):.1f} / {max(values):.1f} s"
    return text.replace(f"{limit:.1f}", f"> {limit - 0.5:.0f}") + (f" ({late} of {len(values)} never)" if late else "")


def better(of, key):
    return min((of(scale) for scale in (math.pi / 180, 1.0)), key=key)


def main():
    program = sys.argv[1]
    c = template()
    lines = []

    # Lock: four mismatches, four start phases, steady cadence.
    starts = [(factor, phase / 4) for factor in (0.6, 0.8, 1.2, 1.4) for phase in range(4)]
    mine = []
    for factor, start in starts:
        cycles = clock(20, 1000, start, 0.0)
        run, _ = ours(program, value(c, cycles), STRIDE_S / factor)
        mine.append(lock_time(wrapped(cycles - run["estimate"]), run["frequency"] * STRIDE_S - 1, 1000))

    def lock(scale):
        out = []
        for factor, start in starts:
            cycles = clock(20, 100, start, 0.0)
            phase, frequency = theirs(value(c, cycles), 100, STRIDE_S / factor, scale)
            _, mean = centred((cycles - phase)[-300:])
            out.append(lock_time(wrapped(cycles - phase - mean), frequency * STRIDE_S - 1, 100))
        return out

    their = better(lock, lambda out: (statistics.median(out), max(out)))
    lines.append(("lock from -40 to +40 %, 16 starts, median / worst", seconds(mine, 20.0), seconds(their, 20.0)))

    # Steady: the stride duration varies.
    cycles = clock(WALK_S, 1000)
    run, micros = ours(program, value(c, cycles), STRIDE_S)
    off = centred((cycles - run["estimate"])[10_000:])[0] * 360

    def steady(scale):
        at = clock(WALK_S, 100)
        phase, _ = theirs(value(c, at), 100, STRIDE_S, scale)
        off, _ = centred((at - phase)[1000:])
        return float(np.sqrt(np.mean((off * 360) ** 2)))

    lines.append(("steady phase error about its mean, stride varying by 4 %, rms", f"{np.sqrt(np.mean(off ** 2)):.1f} deg", f"{better(steady, float):.1f} deg"))

    # Stop: how long the phase that drives the joints continues after the leg has stopped.
    mine, their = [], {}
    for start in range(8):
        cycles = clock(26, 1000, start / 8, 0.0, 15.0)
        run, _ = ours(program, value(c, cycles), STRIDE_S)
        rate = np.abs(wrapped(np.diff(run["driven"]))) * 1000 * (run["amplitude"][1:] > 0)
        mine.append(float(np.flatnonzero(rate[15_200:] > 0.1 / STRIDE_S)[-1:].sum()) / 1000)
        for scale in (math.pi / 180, 1.0):
            at = clock(26, 100, start / 8, 0.0, 15.0)
            phase, _ = theirs(value(c, at), 100, STRIDE_S, scale)
            rate = np.abs(np.diff(phase)) * 100
            their.setdefault(scale, []).append(float(np.flatnonzero(rate[1520:] > 0.1 / STRIDE_S)[-1:].sum()) / 100)
    their = min(their.values(), key=statistics.median)
    lines.append(("after a stop, until the phase rate is below 10 %, median / worst", f"{statistics.median(mine):.2f} / {max(mine):.2f} s", f"{statistics.median(their):.2f} / {max(their):.2f} s"))

    # One sample that is not a number.
    cycles = clock(14, 1000, 0.0, 0.0)
    angles = value(c, cycles)
    angles[10_000] = math.nan
    run, _ = ours(program, angles, STRIDE_S)
    off = np.abs(wrapped(cycles - run["estimate"]))[10_000:] * 360
    code = (
        "import math,sys\nfrom adaptive_oscillator.oscillator import AdaptiveOscillator as A\n"
        "a=A()\nfor n in range(50): a.update((n+1)/100, .3*math.sin(n*.057))\n"
        "a.update(.51, math.nan)\nfor n in range(51,100): a.update((n+1)/100, .3*math.sin(n*.057))\nprint(a.omega)\n"
    )
    try:
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=30)
        their = f"returns, frequency {done.stdout.strip() or done.stderr.strip().splitlines()[-1]}"
    except subprocess.TimeoutExpired:
        their = "never returns (killed after 30 s)"
    lines.append(("one sample not a number", f"ignored; phase error stays below {off.max():.1f} deg", their))

    # A sensor that sticks in mid swing.
    mine, reported, their = [], [], {}
    # Phase at which the hip is fastest.
    fastest = np.argmax(np.diff(value(c, np.arange(0, 1, 1e-3)))) * 1e-3
    for k in range(8):
        at = 15 + STRIDE_S * ((fastest - 15 / STRIDE_S) % 1) + (k - 4) * 0.01
        cycles = clock(20, 1000, 0.0, 0.0)
        angles = value(c, cycles)
        n = int(at * 1000)
        angles[n:] = angles[n]
        run, _ = ours(program, angles, STRIDE_S)
        mine.append(abs(float(wrapped(cycles - run["driven"])[n + 1000])) * 360)
        reported.append(next(i for i in range(n, len(cycles)) if run["state"][i] != "locked") - n)
        for scale in (math.pi / 180, 1.0):
            slow = clock(20, 100, 0.0, 0.0)
            angles = value(c, slow)
            n = int(at * 100)
            angles[n:] = angles[n]
            phase, _ = theirs(angles, 100, STRIDE_S, scale)
            off = slow - phase
            _, mean = centred(off[n - 300:n])
            their.setdefault(scale, []).append(abs(float(wrapped(off - mean)[n + 100])) * 360)
    their = min(their.values(), key=max)
    lines.append(("stuck sensor in mid swing, reported after", f"{max(reported) / 1000:.3f} s", "never"))
    lines.append(("stuck sensor, phase error 1 s later, worst", f"{max(mine):.1f} deg", f"{max(their):.1f} deg"))

    # Time of an update, the package at 1 kHz too.
    angles = value(c, clock(3, 1000))
    oscillator = AdaptiveOscillator()
    begin = time.perf_counter()
    for n, angle in enumerate(angles):
        oscillator.update((n + 1) / 1000, math.radians(angle))
    their = (time.perf_counter() - begin) / len(angles) * 1e6
    lines.append(("time of an update at 1 kHz", f"{micros:.2f} us (four joints)", f"{their:.0f} us (one signal)"))

    print("| | Footfall (host core) | adaptive-oscillator 0.2.1 |\n|---|---|---|")
    for name, mine, their in lines:
        print(f"| {name} | {mine} | {their} |")


if __name__ == "__main__":
    main()

"""Measures one evaluation of the thesis' search in Python: SciPy's RK45 and, where it is installed, Numba.

Five seconds of the network (eqs 13-16) with a sample every 5 ms. Prints `name seconds` lines, medians of several evaluations.

    pip install scipy numba
    python3 benches/python/thesis_network.py
"""

import statistics
import time

import numpy as np
from scipy.integrate import solve_ivp

SIDE = np.array([1, 0, 3, 2])
LEG = np.array([2, 3, 0, 1])
D = np.array([0.2010, 0.2010, 0.3012, 0.3012])
C = np.array([0.0125, 0.0129, 0.0125, 0.0129])
ALPHA = np.array([0.0014, 0.0020, 0.0108, 0.0108])
W = 2 * np.pi / 1.1
MU = np.full(4, W)
A0 = np.array([5.0, 5.0, 30.0, 30.0])
P = 4 * (ALPHA + 2 * D) / (3 * ALPHA * (W * np.array([20.0, 20.0, 30.0, 30.0])) ** 2)
START = np.array([25.0, -15.0, 45.0, 15.0, 0.0, 0.0, 100.0, -100.0])
SAMPLES = np.arange(1, 1001) * 0.005


def field(_, y):
    x, z = y[:4] - A0, y[4:]
    acceleration = ALPHA * (1 - P * z**2) * z - MU**2 * x + D * (z - z[SIDE]) + C * z[LEG] * x[LEG]
    return np.concatenate((z, acceleration))


def cost(rtol, atol):
    solution = solve_ivp(field, (0.0, 5.0), START, method="RK45", t_eval=SAMPLES, rtol=rtol, atol=atol)
    return float(np.mean(solution.y[:4] ** 2))


def measured(work, count):
    work()
    times = []
    for _ in range(count):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return statistics.median(times)


def numba_times():
    try:
        from numba import njit
    except ImportError:
        return

    @njit
    def slope(y, out):
        for i in range(4):
            side, leg = (i ^ 1), (i + 2) % 4
            z = y[4 + i]
            out[i] = z
            out[4 + i] = (
                ALPHA[i] * (1 - P[i] * z * z) * z
                - MU[i] * MU[i] * (y[i] - A0[i])
                + D[i] * (z - y[4 + side])
                + C[i] * y[4 + leg] * (y[leg] - A0[leg])
            )

    @njit
    def runge_kutta(start, h, steps):
        y, moved = start.copy(), start.copy()
        k1, k2, k3, k4 = np.empty(8), np.empty(8), np.empty(8), np.empty(8)
        total = 0.0
        for step in range(steps):
            slope(y, k1)
            for i in range(8):
                moved[i] = y[i] + 0.5 * h * k1[i]
            slope(moved, k2)
            for i in range(8):
                moved[i] = y[i] + 0.5 * h * k2[i]
            slope(moved, k3)
            for i in range(8):
                moved[i] = y[i] + h * k3[i]
            slope(moved, k4)
            for i in range(8):
                y[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i])
            for i in range(4):
                total += y[i] * y[i]
        return total / (4 * steps)

    # The same motion as SciPy's with a tight tolerance, or the time means nothing.
    exact, own = cost(1e-9, 1e-9), runge_kutta(START, 0.001, 5000)
    if not abs(own - exact) < 0.01 * exact:
        raise SystemExit(f"Numba's network differs from SciPy's: {own} and {exact}")
    print(f"Numba_RK4_1_ms {measured(lambda: runge_kutta(START, 0.001, 5000), 30):.9f}", flush=True)
    print(f"Numba_RK4_5_ms {measured(lambda: runge_kutta(START, 0.005, 1000), 30):.9f}", flush=True)


if __name__ == "__main__":
    print(f"SciPy_RK45_default {measured(lambda: cost(1e-3, 1e-6), 5):.9f}", flush=True)
    print(f"SciPy_RK45_1e-6 {measured(lambda: cost(1e-6, 1e-6), 5):.9f}", flush=True)
    numba_times()

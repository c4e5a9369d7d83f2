"""Reads or fits a recording with Python's usual packages; `cargo xtask bench host` runs it in turn with the project's programs.

    pip install pandas ezc3d mcap mcap-ros2-support scipy
    python3 benches/python/recordings.py read csv walk.csv
    python3 benches/python/recordings.py fit walk.csv

Prints one line: the seconds without the start of Python and the imports, the rows, and the name of what ran.
"""

import sys
import time


def table(file, **options):
    import pandas

    return "pandas", lambda: len(pandas.read_csv(file, **options))


def c3d(file):
    import ezc3d

    return "ezc3d", lambda: ezc3d.c3d(file)["data"]["points"].shape[2]


def mcap(file):
    from mcap_ros2.reader import read_ros2_messages

    return "mcap-ros2-support", lambda: len([message.ros_msg.position[0] for message in read_ros2_messages(file)])


READERS = {
    "csv": table,
    "open-sim": lambda file: table(file, sep="\t", skiprows=6),
    "trc": lambda file: table(file, sep="\t", skiprows=5, header=None),
    "scope": lambda file: table(file, skiprows=9),
    "c3d": c3d,
    "mcap": mcap,
}

HARMONICS = 6
LARGEST_ERROR_DEG = 1.0


def fit(file):
    """The period of the walk, and the mean and the harmonics of each joint, by least squares over all of them."""
    import numpy as np
    import pandas
    from scipy.optimize import least_squares

    def work():
        rows = pandas.read_csv(file).to_numpy()
        time_s, angles = rows[:, 0], rows[:, 1:5]
        spectrum = np.abs(np.fft.rfft(angles[:, 0] - angles[:, 0].mean()))
        frequency = (1 + spectrum[1:].argmax()) / (time_s[-1] - time_s[0])

        def basis(frequency):
            phase = 2 * np.pi * frequency * np.outer(time_s, np.arange(1, HARMONICS + 1))
            return np.hstack((np.ones((len(time_s), 1)), np.cos(phase), np.sin(phase)))

        def residual(parameters):
            return (basis(parameters[0]) @ parameters[1:].reshape(-1, 4) - angles).ravel()

        start = np.linalg.lstsq(basis(frequency), angles, rcond=None)[0]
        found = least_squares(residual, np.concatenate(([frequency], start.ravel())))
        error = np.sqrt(np.mean(found.fun**2))
        # A frequency half a bin off ends in another minimum, where the harmonics fit nothing.
        if not (found.success and error < LARGEST_ERROR_DEG):
            raise SystemExit(f"the least squares end with an error of {error:.2f} degrees: {found.message}")
        return len(rows)

    return f"SciPy, period and {HARMONICS} harmonics", work


def main():
    words = sys.argv[1:]
    if len(words) == 3 and words[0] == "read" and words[1] in READERS:
        name, work = READERS[words[1]](words[2])
    elif len(words) == 2 and words[0] == "fit":
        name, work = fit(words[1])
    else:
        raise SystemExit(f"usage: recordings.py read {'|'.join(READERS)} FILE, or recordings.py fit FILE")
    began = time.perf_counter()
    rows = work()
    print(f"{time.perf_counter() - began:.6f} {rows} {name}")


if __name__ == "__main__":
    main()

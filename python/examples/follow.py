"""Lets a follower follow the left hip of a recording, and prints what it tracks each second: follow.py RECORDING"""

import sys

import numpy as np

import footfall


def main(recording: str) -> None:
    """Prints time, state, stride frequency in Hz and phase in cycles."""
    follower = footfall.fit(recording, follow="left_hip").generator()
    person = footfall.read(recording).condition()
    # The follower takes one sample a millisecond.
    time_s = np.arange(0.0, person.time_s[-1], follower.period_s)
    hip = np.interp(time_s, person.time_s, person.angles_rad[:, person.joints.index("left_hip")])
    following = follower.follow(hip)
    for row in range(999, len(time_s), 1000):
        print(
            f"{following.time_s[row]:5.1f} s  {following.state[row]:8}"
            f"{following.frequency_hz[row]:7.3f} Hz  {following.phase_cycles[row]:.3f}"
        )


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])

"""Replays a recording of a board and prints whether every tick is equal to the bit: replay.py CAPTURE"""

import sys

import numpy as np

import footfall


def main(capture: str) -> None:
    """Prints the counts of the replay, and the hash over all setpoints of the first boot."""
    recorded = footfall.read_capture(capture)
    found = recorded.replay()
    print(f"{found['compared']} of {found['ticks']} ticks compared, {found['different']} different")
    inputs = recorded.inputs()
    rows = np.flatnonzero(inputs.boot == 1)
    ticks = recorded.joint_loop(boot=1).run(
        inputs.codes[rows],
        inputs.vrefint[rows],
        button=inputs.button[rows],
        foot=inputs.foot[rows],
        late=inputs.late[rows],
        fault_bits=inputs.fault_bits[rows],
        elapsed=inputs.elapsed[rows],
        watchdog_hz={row: hertz for row, hertz in inputs.watchdog_hz.items() if row < len(rows)},
        debugger=inputs.debugger[rows],
        program_unproven=inputs.program_unproven[rows],
        requests={row: text for row, text in inputs.requests.items() if row < len(rows)},
    )
    print(f"tick {ticks.tick[-1]}, hash {ticks.setpoint_hash[-1]:016x}")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])

"""A study of how many harmonics a recording needs, one fit a process: study.py RECORDING"""

import multiprocessing
import sys
from typing import Any, Dict, List, Tuple

import footfall

HARMONICS = range(1, 9)


def one(task: Tuple[str, int]) -> Dict[str, Any]:
    """Fits one number of harmonics; the result is plain data, which goes to other processes."""
    recording, harmonics = task
    result = footfall.fit(recording, harmonics=harmonics, starts=10).as_dict()
    errors = [joint["rmse_heldout_deg"] for joint in result["joints"]]
    return {"harmonics": harmonics, "worst_heldout_deg": max(errors)}


def table(results: List[Dict[str, Any]]) -> str:
    """The results as CSV: number of harmonics, error of the worst joint on held-out strides in degrees."""
    rows = [f"{result['harmonics']},{result['worst_heldout_deg']:.4f}" for result in results]
    return "\n".join(["harmonics,worst_heldout_deg", *rows])


def main(recording: str) -> None:
    """Fits on two processes and prints the table."""
    # A process of its own imports footfall itself, on every system.
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        print(table(pool.map(one, [(recording, harmonics) for harmonics in HARMONICS])))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])

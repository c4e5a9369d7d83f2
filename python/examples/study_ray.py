"""The study of study.py on Ray, here with two local workers: study_ray.py RECORDING"""

import logging
import sys
from pathlib import Path
from typing import Any

import ray

import study


def main(recording: str) -> None:
    """Fits on two workers of Ray and prints the table."""
    # The workers import the study from this folder.
    ray.init(
        num_cpus=2,
        include_dashboard=False,
        logging_level=logging.ERROR,
        runtime_env={"env_vars": {"PYTHONPATH": str(Path(__file__).resolve().parent)}},
    )
    one: Any = ray.remote(study.one)
    tasks = [one.remote((recording, harmonics)) for harmonics in study.HARMONICS]
    print(study.table(ray.get(tasks)))
    ray.shutdown()


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])

"""The examples run, and what they print is right."""

import os
import struct
import subprocess
import sys
from pathlib import Path
from typing import List

import pytest

import footfall

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


def run(*arguments: object) -> List[str]:
    """The lines that an example prints."""
    command = [sys.executable, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=EXAMPLES)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout.splitlines()


def test_fit_and_plot_writes_a_picture(samples: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    lines = run("fit_and_plot.py", samples / "walk.csv", tmp_path / "fit.png")
    assert len(lines) == 4 and all("held-out" in line for line in lines)
    picture = (tmp_path / "fit.png").read_bytes()
    assert picture.startswith(b"\x89PNG") and struct.unpack(">II", picture[16:24]) == (1080, 720)


def expected(samples: Path) -> float:
    """The error of the fit with three harmonics, in this process."""
    errors = footfall.fit(samples / "walk.csv", harmonics=3, starts=10).heldout_rmse_deg
    assert errors is not None
    return float(errors.max())


def check_study(lines: List[str], samples: Path) -> None:
    """The table of the study: errors fall with the harmonics, and are those of a fit in this process."""
    rows = [line.split(",") for line in lines[1:]]
    errors = [float(error) for _, error in rows]
    assert lines[0] == "harmonics,worst_heldout_deg" and [row[0] for row in rows] == [str(count) for count in range(1, 9)]
    assert errors[0] > 5 * errors[5] and errors[2] == pytest.approx(expected(samples), abs=1e-4)


def test_the_study_runs_on_processes(samples: Path) -> None:
    check_study(run("study.py", samples / "walk.csv"), samples)


def test_the_study_runs_on_ray(samples: Path) -> None:
    pytest.importorskip("ray", reason="ray is not installed: its package may not exist for this Python")
    lines = run("study_ray.py", samples / "walk.csv")
    check_study(lines[lines.index("harmonics,worst_heldout_deg") :], samples)


def test_the_follower_locks(samples: Path) -> None:
    lines = run("follow.py", samples / "walk.csv")
    assert len(lines) == 39 and all("locked" in line for line in lines[4:])


def test_the_notebook_runs(tmp_path: Path) -> None:
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    pytest.importorskip("matplotlib")
    os.environ["JUPYTER_CONFIG_DIR"] = str(tmp_path)
    notebook = nbformat.read(EXAMPLES / "stride.ipynb", as_version=4)
    client = nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(EXAMPLES)}})
    client.execute()
    outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    assert any("image/png" in output.get("data", {}) for output in outputs)
    assert any("accepted" in output.get("data", {}).get("text/plain", "") for output in outputs)

"""Every public name has a docstring that states units or shapes, and the types of the package hold."""

import inspect
import re
import subprocess
import sys
from pathlib import Path
from typing import Any, Iterator, Tuple

import pytest

import footfall

#: A unit, a shape, or the statement that there is none.
STATED = re.compile(
    r"\b(rad|rad/s|deg|s|ms|us|Hz|V|cycles?|radians|seconds|degrees|units?|shapes?|steps a minute|bits?|N m|kg)\b|\(n", re.IGNORECASE
)


def public() -> Iterator[Tuple[str, Any]]:
    """Every public name of the package, with the methods and properties of its classes."""
    for name in footfall.__all__:
        item = getattr(footfall, name)
        if inspect.isclass(item):
            yield name, item
            for member, value in vars(item).items():
                if not member.startswith("_") and not isinstance(value, type):
                    yield f"{name}.{member}", getattr(item, member) if isinstance(value, classmethod) else value
        elif callable(item):
            yield name, item


@pytest.mark.parametrize("name,item", [pytest.param(*pair, id=pair[0]) for pair in public()])
def test_a_public_name_states_its_units(name: str, item: Any) -> None:
    text = inspect.getdoc(item)
    if text and text.startswith("Alias for field number"):
        return  # The field's own text stands in the source; the class states the units.
    assert text, f"{name} has no docstring"
    assert STATED.search(text), f"{name} states no unit and no shape: {text}"


def test_the_stubs_name_everything_that_exists() -> None:
    """Compares the stubs with the compiled module."""
    stubs = (Path(footfall.__file__).parent / "_footfall.pyi").read_text()
    for kind in ("Generator", "Recording", "Conditioned", "Certificate", "Fit", "JointLoop", "Gate", "Servo", "Capture"):
        text = stubs.split(f"\nclass {kind}:")[1].split("\nclass ")[0].split("\ndef ")[0]
        stated = {name for name in re.findall(r"    def (\w+)\(", text) if not name.startswith("_")}
        exists = {name for name in vars(getattr(footfall, kind)) if not name.startswith("_")}
        assert stated == exists, kind


@pytest.mark.parametrize("what", ["package", "examples"])
def test_types_hold(what: str, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    pytest.importorskip("mypy")
    folder = Path(__file__).resolve().parents[1]
    target = ["-p", "footfall"] if what == "package" else [str(folder / "examples")]
    options = ["--strict", "--cache-dir", str(tmp_path_factory.getbasetemp() / "mypy"), "--config-file", str(folder / "pyproject.toml")]
    command = [sys.executable, "-m", "mypy", *options, *target]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr

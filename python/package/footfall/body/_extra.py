"""MuJoCo and cma, which are installed with the extra ``footfall[body]`` only."""

from importlib import import_module
from types import ModuleType

#: Version of MuJoCo with which the numbers of docs/body.md were measured; another one may give other bits.
MUJOCO = "4.0.0"
#: Version of cma, with which a search finds the same gait again.
CMA = "4.5.0"


def mujoco() -> ModuleType:
    """The module ``mujoco``; an ``ImportError`` that says what to install without it."""
    try:
        # By its name, since it has no types.
        return import_module("mujoco")
    except ImportError as error:
        what = "pip install 'footfall[body]', or ./python[body] in a clone"
        raise ImportError(f"footfall.body needs MuJoCo {MUJOCO}, which is not installed: {what}") from error

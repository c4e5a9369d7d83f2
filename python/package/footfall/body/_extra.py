"""MuJoCo, which is installed with the extra ``footfall[body]`` only."""

from types import ModuleType

#: Version of MuJoCo with which the numbers of docs/body.md were measured; another one may give other bits.
MUJOCO = "4.0.0"


def mujoco() -> ModuleType:
    """The module ``mujoco``; an ``ImportError`` that says what to install without it."""
    try:
        import mujoco as module
    except ImportError as error:
        raise ImportError(f"footfall.body needs MuJoCo {MUJOCO}, which is not installed: pip install 'footfall[body]', or ./python[body] in a clone") from error
    return module  # type: ignore[no-any-return]

"""What a command writes: files that are whole or not there, and standard output. What cannot be written is a `FootfallError`, exit code 1."""

import os
import shutil
import sys
import tempfile
from contextlib import ExitStack, contextmanager, suppress
from typing import Dict, Iterator, Union

from .._errors import FootfallError

Path = Union[str, "os.PathLike[str]"]


def _cannot(path: Path, error: OSError) -> FootfallError:
    return FootfallError(f"{os.fspath(path)}: it cannot be written: {error.strerror or error}")


def check_writable(option: str, path: Path) -> None:
    """Refuses a file that cannot be written, before the work for it; the file stays as it is. ``option`` is that of the message. No unit."""
    target = os.path.realpath(path)
    folder = os.path.dirname(target)
    if os.path.isdir(target):
        raise FootfallError(f"{option} {os.fspath(path)}: it is a folder; allowed is the name of a file")
    if not os.path.isdir(folder):
        raise FootfallError(f"{option} {os.fspath(path)}: its folder does not exist; make it first")
    if os.path.exists(target) and not os.access(target, os.W_OK):
        raise FootfallError(f"{option} {os.fspath(path)}: it cannot be written: no permission; name another file")
    if not os.path.exists(target) or os.path.isfile(target):
        try:
            # Permissions do not say whether a file system is read-only or full.
            with tempfile.TemporaryFile(dir=folder):
                pass
        except OSError as error:
            raise FootfallError(f"{option} {os.fspath(path)}: its folder cannot be written: {error.strerror or error}; name another one") from error


@contextmanager
def whole(path: Path) -> Iterator[str]:
    """Gives the name of a file beside ``path``, with the same ending, that replaces it at the end of the block: an error in the block leaves ``path`` as it was."""
    target = os.path.realpath(path)
    if os.path.exists(target) and not os.path.isfile(target):
        # A device or a pipe is written, not replaced.
        try:
            yield target
        except OSError as error:
            raise _cannot(path, error) from error
        return
    stem, ending = os.path.splitext(target)
    beside = f"{stem}.{os.getpid()}.part{ending}"
    try:
        yield beside
        if os.path.exists(target):
            shutil.copymode(target, beside)
        os.replace(beside, target)
    except OSError as error:
        raise _cannot(path, error) from error
    finally:
        with suppress(OSError):
            os.remove(beside)


def write(texts: Dict[str, str]) -> None:
    """Writes text files, by name: none of them if one of them cannot be written. Lines end with a line feed."""
    with ExitStack() as files:
        for path, text in texts.items():
            beside = files.enter_context(whole(path))
            with open(beside, "w", encoding="utf-8", newline="\n") as file:
                file.write(text)


def show(text: str) -> None:
    """Prints a text. A reader that has gone, as with `head`, is no error."""
    try:
        print(text, flush=True)
    except OSError as error:
        # The flush at the interpreter's end would report it once more.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if not isinstance(error, BrokenPipeError):
            raise FootfallError(f"standard output cannot be written: {error.strerror or error}") from error

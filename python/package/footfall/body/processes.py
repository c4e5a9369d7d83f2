"""Processes for runs that do not depend on each other; the keyboard stops the work between two results."""

import os
import signal
import threading
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from types import FrameType, TracebackType
from typing import Any, Callable, Iterator, Optional, Sequence, Tuple, Type


def _end_with_the_parent() -> None:
    """Ends a process of the pool when the one that started it has been killed: it would wait for work for ever.

    The keyboard reaches every process: the one that started the work stops it, and the others finish their run.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()

    def wait() -> None:
        if parent is not None:
            parent.join()
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


@contextmanager
def _later() -> Iterator[None]:
    """Holds the keyboard's signal back from this thread, and from processes that it starts until they ignore it: one that is just beginning would end."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _Keyboard:
    """Notes the keyboard's signal, whose handler is called by ``deliver`` only.

    An exception in the middle of the executor's code can leave it with work that never ends, and its end waits for that.
    """

    def __init__(self) -> None:
        self._noted: Optional[Tuple[int, Optional[FrameType]]] = None
        self._is_ending = False
        self._before: Any = None

    def hold(self) -> None:
        handler = signal.getsignal(signal.SIGINT)
        # Only the main thread has handlers, and a signal that is ignored stays so.
        if callable(handler) and threading.current_thread() is threading.main_thread():
            self._before = signal.signal(signal.SIGINT, self._note)

    def _note(self, number: int, frame: Optional[FrameType]) -> None:
        self._noted = (number, frame)

    def deliver(self) -> None:
        """Calls the handler there was, which raises ``KeyboardInterrupt`` if it is Python's own, for a signal that came.

        Once it has raised, the work ends, and more signals ask for nothing else: they are dropped, so that they do not cost its results.
        """
        noted, self._noted = self._noted, None
        if noted is None or self._is_ending:
            return
        try:
            self._before(*noted)
        except BaseException:
            self._is_ending = True
            raise

    def release(self) -> None:
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)


class Processes:
    """``jobs`` processes that end with this one; fresh ones, since a fork of one that has threads may hang.

    The keyboard's signal is held until a result is there, or until the end: so ``KeyboardInterrupt`` comes out of ``each`` or of the ``with`` statement,
    and out of nothing else in it. At the end of the statement work that has not begun is dropped, and runs that have begun are waited for.
    """

    def __init__(self, jobs: int) -> None:
        self._jobs = jobs
        self._keyboard = _Keyboard()

    def __enter__(self) -> "Processes":
        self._pool = ProcessPoolExecutor(self._jobs, mp_context=get_context("spawn"), initializer=_end_with_the_parent)
        self._keyboard.hold()
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], value: Optional[BaseException], trace: Optional[TracebackType]) -> None:
        try:
            self._pool.shutdown(cancel_futures=True)
        finally:
            self._keyboard.release()
        if kind is None:
            self._keyboard.deliver()

    def each(self, function: Callable[[Any], Any], work: Sequence[Any], chunksize: int = 1) -> Iterator[Any]:
        """The results in the order of the work; both are sent between processes, ``chunksize`` at once."""
        with _later():
            results = self._pool.map(function, work, chunksize=chunksize)
        for result in results:
            self._keyboard.deliver()
            yield result

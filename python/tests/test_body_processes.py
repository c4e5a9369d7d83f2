"""The processes of a search, which the keyboard stops at the worst moments: the program ends, and its handler is that of before."""

import os
import subprocess
import sys

import pytest

pytest.importorskip("mujoco")

#: Sends the signal as the keyboard does, to every process of the group, and prints how the work ended.
PROGRAM = """
import os, signal
from footfall.body.processes import Processes

def press():
    os.killpg(0, signal.SIGINT)

if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)
    ended = "no signal"
    try:
        with Processes(2) as pool:
            {press_when}
            try:
                print(sum(pool.each(abs, range(40))))
            except KeyboardInterrupt:
                ended = "in each"
                {press_again}
    except KeyboardInterrupt:
        ended = "at the end"
    print(ended, signal.getsignal(signal.SIGINT) is signal.default_int_handler)
"""
#: Between the executor's list of work and its queue: work that is in the list and not in the queue is never done.
IN_SUBMISSION = """put = pool._pool._work_ids.put
            pool._pool._work_ids.put = lambda number: ((press() if number == 7 else None), put(number))"""
#: The other process is still starting.
AT_THE_START = "next(pool.each(abs, [1])); press()"


@pytest.mark.skipif(os.name != "posix", reason="no group of processes that the keyboard reaches")
@pytest.mark.parametrize(
    ("press_when", "press_again", "expected"),
    [
        ("pass", "pass", ["780", "no signal True"]),
        (IN_SUBMISSION, "pass", ["in each True"]),
        (AT_THE_START, "pass", ["in each True"]),
        ("press()", "pass", ["in each True"]),
        ("press()", "press()", ["in each True"]),
        ("pool.each = lambda *_: [780]; press()", "pass", ["780", "at the end True"]),
    ],
)
def test_the_keyboard_ends_the_work_at_any_moment(press_when: str, press_again: str, expected: "list[str]", tmp_path: "os.PathLike[str]") -> None:
    path = os.path.join(tmp_path, "program.py")
    with open(path, "w", encoding="utf-8") as file:
        file.write(PROGRAM.format(press_when=press_when, press_again=press_again))
    done = subprocess.run([sys.executable, path], capture_output=True, text=True, timeout=60, start_new_session=True, check=False)
    assert (done.stdout.split("\n")[:-1], done.stderr, done.returncode) == (expected, "", 0)

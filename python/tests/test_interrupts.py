"""Ctrl-C in long calls: it ends them soon, and says where the object stands. Each runs in an interpreter of its own, as a person's script does."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Dict

import pytest

ROOT = Path(__file__).resolve().parents[2]

#: A call that takes 0.8 s on a fast machine and seconds on others (10 million steps are the most of one call), and what must hold after it.
CALLS: Dict[str, str] = {
    "Generator.run": "g = footfall.Generator.default('eight-joints'); call = lambda: g.run(9000.0, every=100); after = lambda: 0.0 < g.time_s < 9000.0",
    "Generator.step": "g = footfall.Generator.default('eight-joints'); call = lambda: g.step(10_000_000); after = lambda: 0.0 < g.time_s < 9000.0",
    "Generator.follow": "g = footfall.Generator.read('samples/follower.toml'); a = np.zeros(8_000_000); call = lambda: g.follow(a);"
    " after = lambda: 0.0 < g.time_s < 8000.0",
    "JointLoop.run": "g = footfall.JointLoop(); c = np.full((9_000_000, 1), 2048); v = np.full(9_000_000, 1652); call = lambda: g.run(c, v);"
    " after = lambda: 0 < g.last.tick < 9_000_000",
    "certify": "call = lambda: footfall.certify(footfall.Generator.default('eight-joints'), starts=100_000);"
    " after = lambda: True",
    "fit": "call = lambda: footfall.fit('samples/walk.csv', kind='thesis', evaluations=100_000_000); after = lambda: True",
}

#: Calls that use every core; the others use one.
PARALLEL = ("certify", "fit")

SCRIPT = """
import time
import numpy as np
import footfall

{call}
print('begins', flush=True)
begun = time.process_time()
try:
    call()
except KeyboardInterrupt:
    print('interrupted', after(), time.process_time() - begun, flush=True)
else:
    print('ended by itself', flush=True)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGINT for one process")
@pytest.mark.parametrize("name", CALLS)
def test_an_interrupt_ends_the_first_long_call(name: str) -> None:
    program = SCRIPT.format(call=CALLS[name])
    # An own interpreter that takes SIGINT, also where the tests run in the background, which ignores it.
    program = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n" + program
    process = subprocess.Popen([sys.executable, "-c", program], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None and process.stdout.readline() == "begins\n", process.communicate()
    begun = time.monotonic()
    time.sleep(0.3)
    os.kill(process.pid, signal.SIGINT)
    sent = time.monotonic()
    ended = process.stdout.readline().split()
    took_s = time.monotonic() - sent
    assert ended[:2] == ["interrupted", "True"], process.communicate()
    process.kill()
    process.communicate()
    # A busy machine makes any time by the clock long, but no more work: before the interrupt at most that of all threads, after it 0.05 s, and what is left
    # of reading the arguments: 0.2 s of 9 million rows on a fast machine. What shows that the call did not go to its end is `after`.
    threads = (os.cpu_count() or 1) if name in PARALLEL else 1
    most_s = threads * (sent - begun) + 2.0
    assert float(ended[2]) < most_s and took_s < 10.0, f"{ended[2]} of {most_s:.2f} s of processor time, {took_s:.2f} s by the clock"

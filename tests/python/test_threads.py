"""Long calls: the GIL is free, progress is told, Ctrl-C stops them."""

import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import lumihull

# Trains on so many colours that it takes a while on any machine.
LONG = """
import numpy as np, lumihull
colours = np.random.default_rng(1).integers(0, 256, (2_000_000, 3)).astype(np.uint8)
"""


def long_call(**keywords: object) -> lumihull.ColorKey:
    colours = np.random.default_rng(1).integers(0, 256, (100_000, 3)).astype(np.uint8)
    return lumihull.ColorKey.train(colours, **keywords)  # type: ignore[arg-type]


def test_other_threads_run_meanwhile() -> None:
    counted, stop = 0, threading.Event()

    def count() -> None:
        nonlocal counted
        while not stop.is_set():
            counted += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    before = counted
    long_call(threads=1)
    during = counted - before
    stop.set()
    thread.join()
    assert during > 5  # none, were the GIL held


Ball = tuple[list[lumihull.View], list[np.ndarray]]


def test_progress_is_told_on_the_callers_thread(ball: Ball) -> None:
    said: list[tuple[str, int, int]] = []
    threads = set()

    def listen(progress: lumihull.Progress) -> None:
        said.append((progress.stage, progress.done, progress.total))
        threads.add(threading.get_ident())

    lumihull.carve(*ball, resolution=256, progress=listen)
    assert threads == {threading.get_ident()}
    assert all(stage and 0 <= done <= total for stage, done, total in said)
    assert said[-1][1] == said[-1][2]


def test_what_the_callback_raises_stops_the_call(ball: Ball) -> None:
    def refuse(progress: lumihull.Progress) -> None:
        raise LookupError("enough")

    with pytest.raises(LookupError, match="enough"):
        lumihull.carve(*ball, resolution=1000, threads=1, progress=refuse)


@pytest.mark.parametrize("with_progress", [False, True])
def test_control_c(tmp_path: Path, with_progress: bool) -> None:
    script = (
        LONG
        + f"""
try:
    print("started", flush=True)
    lumihull.ColorKey.train(colours, threads=1, progress={"lambda p: None" if with_progress else "None"})
    print("finished")
except KeyboardInterrupt:
    print("interrupted")
"""
    )
    child = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, env=os.environ)
    assert child.stdout is not None
    assert child.stdout.readline() == "started\n"
    time.sleep(0.2)
    child.send_signal(signal.SIGINT)
    out, _ = child.communicate(timeout=60)
    assert out == "interrupted\n"


def test_a_capture_in_use_is_refused_to_others(own_copy: lumihull.Capture) -> None:
    """A call that lets go of the GIL would race with them."""
    caught: list[lumihull.Error] = []

    def meddle(progress: lumihull.Progress) -> None:
        for call in (own_copy.describe, own_copy.save, lambda: own_copy.set_pose(1, None), lambda: own_copy.names):
            with pytest.raises(lumihull.Error) as error:
                call()
            caught.append(error.value)

    own_copy.run_stage("hull", force=True, progress=meddle)
    assert caught and all(e.code == "invalid_argument" for e in caught)
    assert own_copy.describe()["photos"] == 24  # free again
    with pytest.raises(lumihull.Error):
        own_copy.run_stage("nonsense")
    assert len(own_copy.names) == 24  # after a failure, too


def test_many_threads_read_one_capture(finished: lumihull.Capture) -> None:
    with ThreadPoolExecutor(4) as pool:
        photos = list(pool.map(finished.read_photo, range(24)))
    assert all(np.array_equal(photos[i].array, finished.read_photo(i).array) for i in (0, 23))

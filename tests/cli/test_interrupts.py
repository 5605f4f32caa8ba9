"""Ctrl-C on a real process, from its first moment on: one line, exit code 130, nothing half written."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import trimesh

PROMPT = 5.0  # seconds, where much else runs; on an idle machine a tenth of it


def start(*arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "partwright", *arguments],
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )


@pytest.fixture
def ball(tmp_path: Path) -> Path:
    path = tmp_path / "ball.stl"
    trimesh.creation.icosphere(5).export(path)
    return path


def listens(process: subprocess.Popen[str]) -> bool:
    """Python itself has only the main thread."""
    return len(os.listdir(f"/proc/{process.pid}/task")) > 1


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="no /proc to see threads in")
@pytest.mark.parametrize("delay", [0.0, 0.05, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8])
def test_in_the_first_second(ball: Path, delay: float) -> None:
    process = start("fit", str(ball))
    while not listens(process):
        time.sleep(0.002)
    time.sleep(delay)
    process.send_signal(signal.SIGINT)
    sent = time.monotonic()
    out, error = process.communicate(timeout=60)
    assert time.monotonic() - sent < PROMPT
    assert process.returncode == 130, error
    assert out == ""
    assert "Traceback" not in error
    assert error.splitlines()[-1] == "partwright: interrupted; nothing was written"
    assert list(ball.parent.iterdir()) == [ball]


def test_a_fit_says_at_once_that_it_stops_and_keeps_its_best(ball: Path) -> None:
    process = start("fit", str(ball), "-o", str(ball.parent / "out"), "--quality", "high")
    assert process.stderr is not None
    while "IoU" not in process.stderr.readline():
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    sent = time.monotonic()
    while "stopping after this step; Ctrl-C again to stop at once" not in process.stderr.readline():
        assert time.monotonic() - sent < PROMPT
    _, error = process.communicate(timeout=120)
    assert process.returncode == 130, error
    assert "holds the best assembly so far" in error
    assert (ball.parent / "out" / "preview.png").exists()


def test_the_second_press_ends_a_fit_at_once(ball: Path) -> None:
    process = start("fit", str(ball), "-o", str(ball.parent / "out"), "--quality", "high")
    assert process.stderr is not None
    while "IoU" not in process.stderr.readline():
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    sent = time.monotonic()
    _, error = process.communicate(timeout=60)
    assert time.monotonic() - sent < PROMPT
    assert process.returncode == 130
    assert error.splitlines()[-1] == "partwright: interrupted; nothing was written"
    assert list(ball.parent.iterdir()) == [ball]


def test_a_handler_that_catches_everything_does_not_keep_it() -> None:
    code = (
        "import os, signal, time\nfrom partwright.cli.interrupts import listen\nlisten()\n"
        "try:\n    os.kill(os.getpid(), signal.SIGINT); time.sleep(20)\nexcept BaseException: time.sleep(20)"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=15)
    assert (ended.returncode, ended.stdout) == (130, "")
    assert ended.stderr == "partwright: interrupted; nothing was written\n"


def test_the_first_stops_a_run_and_the_second_ends_it(tmp_path: Path) -> None:
    code = """
import os, signal, sys, threading, time
from partwright.cli.interrupts import listen, stopping
listen()
from partwright.atomic_io import replacing_files
asked = threading.Event()
with stopping(asked.set), replacing_files(sys.argv[1]) as staging:
    (staging / "half").write_text("half")
    os.kill(os.getpid(), signal.SIGINT)
    assert asked.wait(10)
    time.sleep(0.5)
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(20)
"""
    ended = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "out")], capture_output=True, text=True, timeout=15
    )
    assert ended.returncode == 130
    assert ended.stderr.splitlines() == [
        "partwright: stopping after this step; Ctrl-C again to stop at once",
        "partwright: interrupted; nothing was written",
    ]
    assert all(re.match(r"\.", path.name) is None and not any(path.iterdir()) for path in tmp_path.iterdir())


def test_two_signals_of_one_press_are_one() -> None:
    code = """
import os, signal, time
from partwright.cli.interrupts import listen, stopping
listen()
with stopping(lambda: None):
    for _ in range(3):
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.02)
    time.sleep(0.5)
"""
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=15)
    assert ended.returncode == 0
    assert ended.stderr.count("stopping after this step") == 1


def test_a_forked_process_leaves_its_parent_alone() -> None:
    code = """
import os, signal, time
from partwright.cli.interrupts import listen
listen()
child = os.fork()
if not child:
    time.sleep(20)
time.sleep(0.2)
os.kill(child, signal.SIGINT)
_, status = os.waitpid(child, 0)
assert os.waitstatus_to_exitcode(status) == -signal.SIGINT
time.sleep(0.3)
"""
    subprocess.run([sys.executable, "-c", code], check=True, timeout=15)


def test_where_ctrl_c_is_ignored_it_stays_so() -> None:
    code = (
        "import os, signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\n"
        "from partwright.cli.interrupts import listen\nlisten()\nos.kill(os.getpid(), signal.SIGINT)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=15)


def test_work_that_keeps_what_is_done_gets_an_exception() -> None:
    code = """
import os, signal, time
from partwright.cli.interrupts import listen, raising
listen()
try:
    with raising():
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(20)
except KeyboardInterrupt:
    print("kept")
"""
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=15)
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "kept\n", "")

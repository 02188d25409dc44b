"""A simulation with threads in a forked child: a clear error, where it would wait for ever."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import mcmj
from mcmj.utils.errors import McmjError

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")

USES = ("rollout", "reset", "snapshot", "delete", "new", "single")


def child(use, threaded, single):
    if use == "rollout":
        threaded.rollout(5)
    elif use in ("reset", "snapshot"):
        getattr(threaded, use)()
    elif use == "new":
        mcmj.Ensemble(single.body, copies=2, threads=2).rollout(5)
    elif use == "single":
        single.rollout(5)


def fork_after_threads(use):
    """In a process of its own: prints how the child ended."""
    body = mcmj.random_body(1, nodes=6)
    threaded, single = mcmj.Ensemble(body, copies=2, threads=2), mcmj.Simulation(body)
    threaded.rollout(5)
    pid = os.fork()
    if pid == 0:
        signal.alarm(20)
        try:
            child(use, threaded, single)
            del threaded
        except McmjError as error:
            assert "spawn" in str(error)  # noqa: PT017
            os._exit(7)
        os._exit(0)
    status = os.waitpid(pid, 0)[1]
    threaded.rollout(5)  # the parent goes on
    print(os.waitstatus_to_exitcode(status))


@pytest.mark.parametrize("use", USES)
def test_a_forked_child_is_told(use):
    code = f"import test_forking as t; t.fork_after_threads({use!r})"
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code],
        cwd=Path(__file__).parent, capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert done.stdout == ("7\n" if use in USES[:3] else "0\n"), done.stderr

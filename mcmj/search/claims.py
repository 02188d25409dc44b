"""Who holds a trial: the owner of a claim, and whether it still lives."""

import os
import socket
import time
from pathlib import Path

LEASE = 60.0  # s: a claim that was not renewed for so long is void


def own_name() -> str:
    """host/process-namespace/process/start time/random: no two stores have the same."""
    place = [socket.gethostname(), _process_space(), str(os.getpid()), _born(os.getpid())]
    return "/".join([*place, os.urandom(4).hex()])


def is_held(owner: str, until: float) -> bool:
    """Whether a claim holds: renewed in time, and its process not seen to be dead."""
    if not time.time() <= until <= time.time() + 2 * LEASE:  # far ahead: a wrong clock, or damage
        return False
    if owner.count("/") != 4:  # written by no store
        return False
    host, space, process, born, _ = owner.split("/")
    if (host, space) != (socket.gethostname(), _process_space()) or not born:
        return True  # from elsewhere: only time will tell
    return _born(int(process)) == born


def _process_space() -> str:
    try:
        return os.readlink("/proc/self/ns/pid")
    except OSError:
        return ""


def _born(process: int) -> str:
    """Start time of a process, "" if there is none or nobody says."""
    try:
        stat = Path(f"/proc/{process}/stat").read_text()
    except OSError:
        return ""
    state, *rest = stat.rpartition(")")[2].split()
    return "" if state == "Z" else rest[18]

"""Bodies of the authors' public Matlab toolbox, from .mat files (`save` of a `net` structure).

What is read of the structure, N masses, L springs, indices from 1:

    P.states (N, 4): x, y, dx/dt, dy/dt now      P.fixed (N, 1)
    W.from, W.to, W.k1, W.k3, W.d1, W.d3, W.l0, W.dist_old (L, 1)
    W_in (N, nInputs), W_fb (N, nOutputs)        horizontal force per unit
    W_out (L, nOutputs), readout_type 'LENGTHS'
    init_data.time_step, init_data.P.states      the step [s]; where the masses started
    tansig, rk_steps                             if there: tanh-like springs; "rk" scheme

(init_ms_sys_net.m and simulate_ms_sys.m of github.com/helmuthauser/
Matlab_Morphological_Computation_Simulation.) Mass is 1 there. Not read: noise, `info`.
"""

import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from mcmj.core.body import Body
from mcmj.core.trajectory import State
from mcmj.utils.errors import BodyFileError, UnknownNameError
from mcmj.utils.validation import Array

READER = Path(__file__).with_name("mat_reader.py")
PATIENCE = 60.0  # s: a net of a thousand springs takes less than one


@dataclass(frozen=True)
class ToolboxNet:
    """A `net` of the toolbox.

    Attributes:
        body: geometry, springs and weights; its positions are where the masses started.
        w_out: (L, n_outputs); None if the readout is one of positions.
        timestep: [s].
        method: "toolbox_euler" or "toolbox_rk", for mcmj.reference.integrate.
        springs: "native", or "tansig" for Simulation(springs=..).
        state: where the masses were when it was saved; `integrate` goes on from there.
    """

    body: Body
    w_out: Array | None
    timestep: float
    method: str
    springs: str
    state: State


def load_toolbox_net(path: str | Path, name: str | None = None) -> ToolboxNet:
    """Read a body from a .mat file of versions 4 to 7, in a process of its own.

    Args:
        name: of the variable; needed only if the file holds several nets.

    Raises:
        BodyFileError: no such file, not a .mat file, a damaged one, or no net in it.
        UnknownNameError: no net of that name, or several and no name.
    """
    if not Path(path).is_file():
        raise BodyFileError(f"no such .mat file: {path}")
    nets = {key: value for key, value in _variables(Path(path)).items() if _is_net(value)}
    if not nets:
        raise BodyFileError(f"{path}: no structure with the fields P and W of the toolbox")
    if name is None and len(nets) == 1:
        name = next(iter(nets))
    if name not in nets:
        raise UnknownNameError("net", name, nets)
    try:
        return _read(nets[name])
    except (KeyError, IndexError, ValueError, TypeError, AttributeError) as error:
        missing = f"no field {error}" if isinstance(error, KeyError) else str(error)
        raise BodyFileError(f"{path}: {name} is not a net of the toolbox: {missing}") from error


def _variables(path: Path) -> dict[str, Any]:
    """The file's structures as nested dictionaries of arrays and texts.

    Raises:
        BodyFileError: SciPy cannot read it, crashes on it, or hangs.
    """
    with TemporaryDirectory() as folder:
        plain = Path(folder) / "plain.npz"
        command = [sys.executable, "-P", str(READER), str(path), str(plain)]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            raise BodyFileError(f"{path}: not read after {PATIENCE:g} s; damaged?") from None
        if done.returncode:
            said = done.stderr.splitlines()[-1:] if done.returncode == 1 else []
            reason = said[0] if said else f"its reader crashed ({done.returncode}); damaged?"
            raise BodyFileError(f"{path}: {reason}")
        with np.load(plain, allow_pickle=False) as file:
            return _nested(file)


def _nested(arrays: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """{"net": {"P": ..}} of {"net/P": ..}; text and single numbers as such."""
    whole: dict[str, Any] = {}
    for path, array in arrays.items():
        *parents, name = path.split("/")
        place = whole
        for parent in parents:
            place = place.setdefault(parent, {})
        place[name] = array if array.ndim else array.item()
    return whole


def _is_net(value: object) -> bool:
    return isinstance(value, dict) and {"P", "W"} <= value.keys()


def _read(net: dict[str, Any]) -> ToolboxNet:
    points, springs, settings = net["P"], net["W"], net.get("init_data", {})
    states = np.atleast_2d(points["states"]).astype(np.float64)
    start = np.atleast_2d(settings["P"]["states"]) if "P" in settings else states
    n_nodes, n_springs = len(states), np.size(springs["from"])
    body = Body(
        start[:, :2],
        np.column_stack([np.ravel(springs["from"]), np.ravel(springs["to"])]) - 1,
        **{name: np.ravel(springs[name]) for name in ("k1", "k3", "d1", "d3")},
        rest_lengths=np.ravel(springs["l0"]),
        fixed=np.ravel(points["fixed"]).astype(bool),
        w_in=_matrix(net.get("W_in"), n_nodes),
        w_fb=_matrix(net.get("W_fb"), n_nodes),
    )
    lengths = net.get("readout_type", "LENGTHS") == "LENGTHS" and "W_out" in net
    state = State(
        positions=np.ascontiguousarray(states[:, :2]),
        velocities=np.ascontiguousarray(states[:, 2:4]),
        previous_lengths=np.ravel(springs["dist_old"]).astype(np.float64),
        pending_output=np.zeros(body.n_outputs),
    )
    return ToolboxNet(
        body=body,
        w_out=_matrix(net["W_out"], n_springs) if lengths else None,
        timestep=float(settings.get("time_step", 1e-3)),
        method="toolbox_rk" if "rk_steps" in net else "toolbox_euler",
        springs="tansig" if "tansig" in net else "native",
        state=state,
    )


def _matrix(value: object, rows: int) -> Array:
    """(rows, columns): Matlab's files lose the second axis of a column, and empty columns."""
    array = np.asarray(0.0 if value is None else value, dtype=np.float64)
    return array.reshape(rows, -1) if array.size and array.ndim else np.zeros((rows, 0))

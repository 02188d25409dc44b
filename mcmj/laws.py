"""The compiled callbacks: the readout law and custom spring laws, run by MuJoCo in C.

Readout law (design: one law for every experiment), for feedback channel c with gate g_c:

    bias force of actuator c = g_c (sum_j user[c, j] s_j + user[c, n])     s = length sensors

It is MuJoCo's own actuator law, force = gain * ctrl + bias, with ctrl as the offset. The
actuator carries biasprm = [gate, TAG, address of the first sensor, number of sensors] and
the weights (and, if there is room, the readout's bias) as user data.

Spring law: a tendon with user data [TAG, address of the law, l0, k1, k3, d1, d3] is pulled
by law(l - l0, dl/dt, k1, k3, d1, d3), applied through the sparse tendon Jacobian.

Both callbacks do nothing for actuators and tendons without the TAG, so other models in the
process are safe. MuJoCo holds one callback of each kind per process: `install` refuses to
replace one that is not ours, and `uninstall` takes ours out again.
"""

from collections.abc import Callable
from typing import Any

import mujoco
import numba
from llvmlite import ir
from numba import extending, types

from mcmj.errors import McmjError
from mcmj.structs import word_offsets

CFunction = Any  # a ctypes function pointer
intrinsic: Any = extending.intrinsic  # compiled calls do not have its Python signature

TAG = 20120595.0  # marks our actuators and tendons: the paper's year and first page
N_BIAS_PARAMETERS = 10  # mjNBIAS
SPRING_USER_SIZE = 7

_Pull = types.float64(*[types.float64] * 6)
_FAST = {"contract", "reassoc", "nsz", "arcp"}  # NaN and infinity keep their meaning


@intrinsic
def _doubles(typingctx: Any, address: Any) -> Any:
    """A pointer to float64 from an integer address."""
    return types.CPointer(types.float64)(types.int64), _int_to_pointer(ir.DoubleType())


@intrinsic
def _integers(typingctx: Any, address: Any) -> Any:
    """A pointer to int32 from an integer address."""
    return types.CPointer(types.int32)(types.int64), _int_to_pointer(ir.IntType(32))


def _int_to_pointer(element: ir.Type) -> Callable:
    def codegen(context, builder, signature, args):
        return builder.inttoptr(args[0], element.as_pointer())

    return codegen


@intrinsic
def _call_pull(typingctx, address, x1, x2, k1, k3, d1, d3):
    """Call the compiled spring law at an address."""

    def codegen(context, builder, signature, args):
        double = ir.DoubleType()
        function = ir.FunctionType(double, [double] * 6)
        return builder.call(builder.inttoptr(args[0], function.as_pointer()), args[1:])

    return types.float64(types.int64, *[types.float64] * 6), codegen


@intrinsic
def _bits(typingctx: Any, number: Any) -> Any:
    """The 64 bits of a float64 as an integer: tendon user data holds addresses that way."""

    def codegen(context, builder, signature, args):
        return builder.bitcast(args[0], ir.IntType(64))

    return types.int64(types.float64), codegen


def _compile_readout(model_at: dict[str, int], data_at: dict[str, int]) -> CFunction:
    """The mjcb_act_bias callback. Offsets are closure variables: Numba's cache keys on them."""
    n_user_at, user_at = model_at["nuser_actuator"], model_at["actuator_user"]
    parameters_at, sensors_at = model_at["actuator_biasprm"], data_at["sensordata"]
    words = types.CPointer(types.int64)

    def readout(model, data, actuator):
        parameters = _doubles(model[parameters_at])
        first = actuator * N_BIAS_PARAMETERS
        gate = parameters[first]
        if parameters[first + 1] != TAG or gate == 0.0:
            return 0.0
        n_user = model[n_user_at]
        n_sensors = numba.int64(parameters[first + 3])
        weights = numba.carray(_doubles(model[user_at] + 8 * n_user * actuator), n_user)
        sensors = numba.carray(
            _doubles(data[sensors_at] + 8 * numba.int64(parameters[first + 2])), n_sensors
        )
        output = 0.0
        for j in range(n_sensors):
            output += weights[j] * sensors[j]
        if n_user > n_sensors:
            output += weights[n_sensors]
        return gate * output

    signature = types.float64(words, words, types.int32)
    return numba.cfunc(signature, cache=True, fastmath=_FAST)(readout).ctypes


def _compile_springs(model_at: dict[str, int], data_at: dict[str, int]) -> CFunction:
    """The mjcb_passive callback: qfrc_passive -= J^T pull for every tendon with a law."""
    n_tendon_at, n_user_at = model_at["ntendon"], model_at["nuser_tendon"]
    user_at, rownnz_at = model_at["tendon_user"], model_at["ten_J_rownnz"]
    rowadr_at, colind_at = model_at["ten_J_rowadr"], model_at["ten_J_colind"]
    jacobian_at, length_at = data_at["ten_J"], data_at["ten_length"]
    velocity_at, force_at = data_at["ten_velocity"], data_at["qfrc_passive"]
    words = types.CPointer(types.int64)

    def springs(model, data):
        n_user = model[n_user_at]
        if n_user < SPRING_USER_SIZE:
            return
        user = _doubles(model[user_at])
        rownnz, rowadr = _integers(model[rownnz_at]), _integers(model[rowadr_at])
        colind, jacobian = _integers(model[colind_at]), _doubles(data[jacobian_at])
        length, velocity = _doubles(data[length_at]), _doubles(data[velocity_at])
        force = _doubles(data[force_at])
        for tendon in range(model[n_tendon_at]):
            u = tendon * n_user
            law = _bits(user[u + 1])
            if user[u] != TAG or law == 0:
                continue
            x1 = length[tendon] - user[u + 2]
            pull = _call_pull(
                law, x1, velocity[tendon], user[u + 3], user[u + 4], user[u + 5], user[u + 6]
            )
            for i in range(rowadr[tendon], rowadr[tendon] + rownnz[tendon]):
                force[colind[i]] -= jacobian[i] * pull

    return numba.cfunc(types.void(words, words), cache=True)(springs).ctypes


class _Callback:
    """One of MuJoCo's global callbacks, compiled at first use, installed once."""

    def __init__(self, name: str, compile_: Callable, model_fields: str, data_fields: str):
        self.name = name
        self._compile = lambda: compile_(
            word_offsets("mjModel", model_fields.split()),
            word_offsets("mjData", data_fields.split()),
        )
        self._function: CFunction | None = None

    def _installed(self) -> object:
        return getattr(mujoco, f"get_{self.name}")()

    def install(self) -> None:
        current = self._installed()
        if self._function is not None and current is self._function:
            return
        if current is not None:
            raise McmjError(
                f"another {self.name} is installed in this process ({current!r}), and MuJoCo "
                f"holds only one: remove it with mujoco.set_{self.name}(None) first"
            )
        if self._function is None:
            self._function = self._compile()
        getattr(mujoco, f"set_{self.name}")(self._function)

    def uninstall(self) -> None:
        if self._function is not None and self._installed() is self._function:
            getattr(mujoco, f"set_{self.name}")(None)


_READOUT = _Callback(
    "mjcb_act_bias", _compile_readout, "nuser_actuator actuator_user actuator_biasprm", "sensordata"
)
_SPRINGS = _Callback(
    "mjcb_passive",
    _compile_springs,
    "ntendon nuser_tendon tendon_user ten_J_rownnz ten_J_rowadr ten_J_colind",
    "ten_J ten_length ten_velocity qfrc_passive",
)


def install(*, springs: bool = False) -> None:
    """Install the readout callback, and the spring callback too if asked; idempotent.

    Raises:
        McmjError: another package's callback of that kind is installed.
    """
    _READOUT.install()
    if springs:
        _SPRINGS.install()


def uninstall() -> None:
    """Take our callbacks out of MuJoCo; others' stay. Bodies then run with the loop open."""
    _READOUT.uninstall()
    _SPRINGS.uninstall()

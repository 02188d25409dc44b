"""MuJoCo's C interface: where the fields of its structs are, by the descriptions that its wheel
ships, and its functions in this process."""

import ctypes
import functools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import mujoco
from mujoco.introspect import ast_nodes, enums, structs

from mcmj.utils.errors import McmjError

_SCALARS = {
    "char": ctypes.c_char,
    "signed char": ctypes.c_byte,
    "unsigned char": ctypes.c_ubyte,
    "int": ctypes.c_int,
    "unsigned int": ctypes.c_uint,
    "float": ctypes.c_float,
    "double": ctypes.c_double,
    "size_t": ctypes.c_size_t,
    "int64_t": ctypes.c_int64,
    "uint64_t": ctypes.c_uint64,
    "uintptr_t": ctypes.c_size_t,
    "mjtNum": ctypes.c_double,
    "mjtByte": ctypes.c_ubyte,
    "mjtBool": ctypes.c_bool,
    "mjtSize": ctypes.c_int64,
}


def word_offsets(struct: str, names: Sequence[str]) -> dict[str, int]:
    """Offsets of the named fields of mjModel or mjData, in units of 8 bytes."""
    layout = _verified_layout(struct)
    offsets = {}
    for name in names:
        offset = getattr(layout, name).offset
        if offset % 8:
            raise McmjError(f"{struct}.{name} is not aligned to 8 bytes (offset {offset})")
        offsets[name] = offset // 8
    return offsets


def byte_offset(struct: str, path: str) -> int:
    """Offset in bytes of a field of mjModel or mjData, "opt.timestep" say."""
    name, _, inner = path.partition(".")
    outer: Any = _verified_layout(struct)
    offset = getattr(outer, name).offset
    return offset + getattr(dict(outer._fields_)[name], inner).offset if inner else offset


@functools.cache
def function_address(name: str) -> int:
    """The address of a function of MuJoCo's C interface, "mj_step" say.

    Raises:
        McmjError: MuJoCo's library is not where its wheels have it.
    """
    folder = Path(mujoco.__file__).parent
    for pattern in ("libmujoco*.so*", "libmujoco*.dylib", "mujoco.dll"):
        for library in sorted(folder.glob(pattern)):
            function = getattr(ctypes.CDLL(str(library)), name)
            return int(ctypes.cast(function, ctypes.c_void_p).value or 0)
    raise McmjError(f"no MuJoCo library in {folder}")


@functools.cache
def _layout(struct: str) -> type[ctypes.Structure]:
    return _aggregate(struct, ctypes.Structure, structs.STRUCTS[struct].fields)


def _aggregate(name: str, base: type, fields: Sequence) -> type:
    return type(name, (base,), {"_fields_": [(f.name, _ctype(f.type)) for f in fields]})


def _ctype(node: object) -> type:
    if isinstance(node, ast_nodes.PointerType):
        return ctypes.c_void_p
    if isinstance(node, ast_nodes.ArrayType):
        ctype = _ctype(node.inner_type)
        for extent in reversed(node.extents):
            ctype = ctype * extent
        return ctype
    if isinstance(node, ast_nodes.AnonymousUnionDecl):
        return _aggregate("union", ctypes.Union, node.fields)
    if isinstance(node, ast_nodes.AnonymousStructDecl):
        return _aggregate("struct", ctypes.Structure, node.fields)
    if isinstance(node, ast_nodes.ValueType):
        name = node.name.removeprefix("struct ").removesuffix("_")
        if name in _SCALARS:
            return _SCALARS[name]
        if name in structs.STRUCTS:
            return _layout(name)
        if name in enums.ENUMS:
            return ctypes.c_int
    raise McmjError(f"MuJoCo {mujoco.__version__}: unknown C type {node!r}")


@functools.cache
def _verified_layout(struct: str) -> type[ctypes.Structure]:
    """The layout, after one pointer of each struct was found where the bindings have it."""
    # not MjModel.from_xml_string: the last model that it made, MuJoCo can write, and it is a user's
    spec = mujoco.MjSpec.from_string(
        "<mujoco><worldbody><site name='a'/><body><inertial mass='1' pos='0 0 0' "
        "diaginertia='1 1 1'/><joint type='slide'/><site name='b' pos='1 0 0'/></body></worldbody>"
        "<tendon><spatial name='t'><site site='a'/><site site='b'/></spatial></tendon>"
        "<actuator><motor tendon='t' user='1'/></actuator>"
        "<sensor><tendonpos tendon='t'/></sensor></mujoco>"
    )
    model = spec.compile()
    owner, array = {
        "mjModel": (model, model.actuator_user),
        "mjData": (data := mujoco.MjData(model), data.sensordata),
    }[struct]
    field = {"mjModel": "actuator_user", "mjData": "sensordata"}[struct]
    layout = _layout(struct)
    found = getattr(layout.from_address(owner._address), field)
    if found != array.ctypes.data:
        raise McmjError(
            f"MuJoCo {mujoco.__version__}: its description of {struct} does not fit its library; "
            "use a release that mcmj supports (see pyproject.toml)"
        )
    return layout

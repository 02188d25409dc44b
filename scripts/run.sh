#!/bin/sh
# From a fresh clone to a running program in one command:
#     sh scripts/run.sh limit_cycle [args...]
# Needs only Python >= 3.11: it makes .venv, installs the package there and what COMMAND needs of
# its extras, sees to off-screen rendering, then becomes the program. Later it costs about 0.1 s.
#   PYTHON=/path/to/python   the interpreter to make .venv with
#   MCMJ_NO_APT=1            never install system packages, even when root
set -eu
unset PYTHONHOME PYTHONPATH  # ROS and the like would mix their own packages in

root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd -P)
venv=$root/.venv
vpy=$venv/bin/python
# state/ours: .venv was made here ("version path"); state/stamp: it is complete, for what, with
# which extras; state/gl: egl, osmesa, or "none" and the GL libraries of that time.
state=$venv/.mcmj
gl_packages="libegl1 libegl-mesa0 libgl1-mesa-dri libopengl0"

say() { printf 'mcmj: %s\n' "$*" >&2; }
die() { say "$@"; exit 1; }

usage() {
    echo "usage: sh scripts/run.sh COMMAND [args...]     where COMMAND is one of"
    for f in "$root"/mcmj/experiments/*/command.py; do
        echo "    $(basename "$(dirname "$f")")"
    done
    echo "    test    (pytest on all cores), or any program of .venv/bin"
}

# A candidate may be too old, built without ssl, or a pyenv shim that cannot run. Prints the
# real executable: no shim, and never that of the .venv, which may be replaced.
find_python() {
    for p in "${PYTHON:-python3}" python3 python3.14 python3.13 python3.12 python3.11 python \
        /usr/bin/python3 "${PYENV_ROOT:-${HOME:-}/.pyenv}"/versions/3.1[1-9]*/bin/python; do
        "$p" -c 'import ssl, sys, venv
assert sys.version_info >= (3, 11)
print(getattr(sys, "_base_executable", None) or sys.executable)' 2>/dev/null && return
    done
    return 1
}

venv_version() { "$vpy" -ISc 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null; }
wanted_stamp() { echo "$ver $root $(cksum <"$root/pyproject.toml")"; }

# The extra that a command needs, if any: an experiment says so in its folder.
extra_of() {
    case $1 in
        test | pytest | ruff | mypy | sphinx-build) echo dev ;;
        *) sed -n 's/^EXTRA = "\([a-z]*\)".*/\1/p' "$root/mcmj/experiments/$1/__init__.py" ;;
    esac 2>/dev/null || :
}

# Extras that are installed, as in theory,search; nothing if the stamp is of another form.
installed_extras() {
    found=$(sed -n 's/^.*:\([a-z,]*\)$/\1/p' "$state/stamp" 2>/dev/null) || :
    echo "${found-}"
}

python_ready() {
    ver=$(venv_version) || return 1
    installed=$(installed_extras)
    [ "$(cat "$state/stamp" 2>&1)" = "$(wanted_stamp):$installed" ] || return 1
    case ",$installed,," in *,dev,* | *",$extra,"*) ;; *) return 1 ;; esac
}

reusable() {
    ver=$(venv_version) || return 1   # no .venv, or its interpreter vanished
    [ -f "$state/ours" ] || return 0  # made by the user: keep it
    # Ours: only if it was once complete (not interrupted) and has not been moved.
    [ -f "$state/stamp" ] && [ "$(cat "$state/ours")" = "$ver $root" ]
}

make_venv() {
    py=$(find_python) || die "no Python >= 3.11 (with ssl and venv) found; install one (Debian," \
        "Ubuntu: apt-get install python3 python3-venv) or name it: PYTHON=/path/to/python"
    say "creating .venv with $("$py" --version) ..."
    { rm -rf "$venv" && mkdir -p "$state" && : >"$state/ours"; } || die "cannot write $venv"
    # Without pip, as Debian's python3 has no ensurepip unless python3-venv is there.
    { "$py" -m venv --without-pip "$venv" && ver=$(venv_version); } || die "could not create $venv"
    echo "$ver $root" >"$state/ours"
}

# Python's own pip; else the one of the interpreter that made .venv; else Debian's package.
get_pip() {
    "$vpy" -m pip --version >/dev/null 2>&1 || "$vpy" -m ensurepip >/dev/null 2>&1 ||
        { py=$(find_python) && "$py" -m pip --python "$vpy" install -qq pip 2>/dev/null; } ||
        { apt_install "python$ver-venv" && "$vpy" -m ensurepip >/dev/null; }
}

set_up_python() {
    extras=$(installed_extras)  # these stay
    case ",$extras,," in *",$extra,"*) ;; *) extras=${extras:+$extras,}$extra ;; esac
    reusable || make_venv
    [ "${ver#3.}" -ge 11 ] || die "$venv has Python $ver, not >= 3.11: remove it and run this again"
    { mkdir -p "$state" && rm -f "$state/stamp"; } || die "cannot write $venv"
    get_pip || die "could not get pip: sudo apt-get install python$ver-venv, then run this again"
    say "installing the package${extras:+ with $extras} into .venv (a minute or more) ..."
    stamp=$(wanted_stamp):$extras  # of before, should pyproject.toml change meanwhile
    # Python compiles modules when they are first used: most never are. MuJoCo is the one that all
    # extras take, so that results do not change when one of them is added.
    (cd "$root" && PIP_USER=0 "$vpy" -I scripts/show_pip.py --no-compile \
        -e ".${extras:+[$extras]}" "mujoco<4") ||
        die "the installation failed (see above); run this again to retry"
    # Last, and by renaming: a stamp means that all of the above went well.
    { echo "$stamp" >"$state/new" && mv "$state/new" "$state/stamp"; } || die "cannot write $venv"
}

# apt_install PACKAGE...: only where it asks for no password; quiet, bounded in time.
apt_install() {
    [ -z "${MCMJ_NO_APT:-}" ] && command -v apt-get >/dev/null || return 1
    [ "$(id -u)" = 0 ] && sudo='' || sudo='sudo -n'
    $sudo true 2>/dev/null || return 1
    say "apt-get install $* ..."
    apt="$sudo env DEBIAN_FRONTEND=noninteractive NEEDRESTART_SUSPEND=1 timeout -k 9 300"
    apt="$apt apt-get -y --no-install-recommends -o DPkg::Lock::Timeout=60"
    # Package lists that are missing or old make the first try fail at once.
    { $apt install "$@" || { $apt update && $apt install "$@"; }; } >/dev/null 2>&1
}

gl_libraries() {
    echo /usr/lib/*/lib*GL* /usr/lib/*/libOSMesa* /usr/lib/*/dri /usr/share/glvnd/*/* | cksum
}

gl_ready() {
    gl=$(cat "$state/gl" 2>/dev/null) || return 1
    case $gl in none*) [ "$gl" = "none $(gl_libraries)" ] ;; esac
}

# Can MuJoCo really draw? In a process of its own, as a driver may hang or crash.
probe_gl() {
    for gl in egl osmesa; do
        MUJOCO_GL=$gl timeout -k 9 60 "$vpy" -c 'import mujoco
model = mujoco.MjModel.from_xml_string("<mujoco><worldbody><geom size=\".1\"/></worldbody></mujoco>")
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
with mujoco.Renderer(model, 64, 64) as renderer:
    renderer.update_scene(data)
    assert renderer.render().any()' && return
    done >/dev/null 2>&1
    return 1
}

# Rendering is an extra: nothing here may make the command fail.
set_up_gl() {
    say "trying off-screen rendering ..."
    # shellcheck disable=SC2086  # several packages
    probe_gl || { apt_install $gl_packages && probe_gl; } ||
        { apt_install libosmesa6 && probe_gl; } || {
        say "no off-screen rendering, so no videos; for them: sudo apt-get install $gl_packages"
        gl="none $(gl_libraries)"
    }
    { echo "$gl" >"$state/gl"; } 2>/dev/null || :
}

# Runs with this file as fd 9, whose lock makes a second first run wait. Its children inherit
# that, so it is free only once a killed run's pip has ended too.
set_up() {
    py=$(find_python) || py=$vpy
    [ ! -x "$py" ] || "$py" -c 'import fcntl
try:
    fcntl.flock(9, fcntl.LOCK_EX | fcntl.LOCK_NB)
except BlockingIOError:
    print("mcmj: waiting for another set-up of this .venv ...", flush=True)
    fcntl.flock(9, fcntl.LOCK_EX)
except OSError:
    pass  # a file system without locks' || :
    python_ready || set_up_python
    gl_ready || set_up_gl
}

case ${1:-} in '' | -h | --help | help) usage; exit ;; esac
extra=$(extra_of "$1")
{ python_ready && gl_ready; } || set_up </dev/null >&2 9<"$0"

# Modules are compiled when they are first used (see above). If that were not kept, every start
# would take some seconds more.
unset PYTHONDONTWRITEBYTECODE
# The program gets the rendering that was seen to work, unless the user chose one.
case $gl in egl | osmesa) export MUJOCO_GL="${MUJOCO_GL:-$gl}" ;; esac

name=$1
shift
if [ "$name" = test ]; then
    cd "$root"
    exec "$vpy" -m pytest -n logical --maxprocesses 4 "$@"
elif [ -f "$root/mcmj/experiments/$name/command.py" ]; then
    exec "$vpy" -m mcmj "$name" "$@"
elif [ -f "$venv/bin/$name" ]; then
    exec "$venv/bin/$name" "$@"
fi
say "no such command: $name"
usage >&2
exit 2

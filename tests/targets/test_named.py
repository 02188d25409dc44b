"""Targets by a known name, from a CSV file, by a name in Python."""

import re

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import mcmj
from mcmj.targets.limit_cycles import TARGETS, from_array, target
from mcmj.targets.named import NAMES, named_target, read_curve, require_outputs
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError

ANGLES = 2 * np.pi * np.arange(20) / 20
CIRCLE = np.column_stack([0.1 * np.arange(20), np.sin(ANGLES), np.cos(ANGLES)])
ROWS = [",".join(map(repr, map(float, row))) for row in CIRCLE]
one_file = settings(suppress_health_check=[HealthCheck.function_scoped_fixture])


def written(folder, *lines, name="circle.csv", end="\n"):
    path = folder / name
    path.write_bytes("".join(line + end for line in lines).encode())
    return str(path)


@pytest.mark.parametrize("name", [*TARGETS, "trot"])
def test_known_names(name):
    assert named_target(name).name == name


def test_an_unknown_name_lists_all_that_is_possible():
    with pytest.raises(UnknownNameError) as caught:
        named_target("waltz", "all")
    assert {*NAMES, "all", "a path to a .csv file", "package.module:function"} == set(
        caught.value.choices
    )
    assert "unknown task 'waltz'" in str(caught.value)


@one_file
@given(
    st.integers(4, 30),
    st.integers(2, 4),
    st.floats(1e-3, 10.0),
    st.floats(-100.0, 100.0),
    st.integers(0, 1000),
    st.sampled_from(["\n", "\r\n"]),
    st.booleans(),
)
def test_a_file_is_the_curve_that_was_written(tmp_path, rows, n, step, start, seed, end, blanks):
    values = np.random.default_rng(seed).uniform(-5, 5, (rows, n))
    lines = [
        "time," + ",".join("xyzw"[:n]),
        *(",".join(map(str, [start + k * step, *row])) for k, row in enumerate(values)),
    ]
    if blanks:
        lines = [line for pair in zip(lines, [""] * len(lines), strict=True) for line in pair]
    goal = named_target(written(tmp_path, *lines, end=end))
    assert goal.name == "circle"
    assert goal.period == pytest.approx(rows * step)
    assert goal.sample(step * np.arange(rows)) == pytest.approx(values, abs=1e-6)
    wanted = from_array("circle", values, step)
    assert goal.orbit(50) == pytest.approx(wanted.orbit(50), abs=1e-6)


@pytest.mark.parametrize(
    ("lines", "text"),
    [
        ([], "a header and at least 4 rows"),
        (["t,x,y", *ROWS[:3]], "a header and at least 4 rows"),
        (ROWS, "a header, such as time,x1,x2 in .*circle.csv, line 1, got 0.0,0.0,1.0"),
        (["t,x", *(row.rpartition(",")[0] for row in ROWS)], "a header, such as time,x1,x2"),
        (["t,x,y", *ROWS[:7], "0.7,abc,1", *ROWS[8:]], "3 numbers in .*line 9, got 0.7,abc,1"),
        (["t,x,y", *ROWS[:7], "0.7,nan,1", *ROWS[8:]], "3 numbers in .*line 9, got 0.7,nan,1"),
        (["t,x,y", *ROWS[:7], "0.7,1", *ROWS[8:]], "3 numbers in .*line 9, got 0.7,1"),
        (["t,x,y", *ROWS[:7], *ROWS[8:]], "a step of 0.1 s, > 0 in .*line 9, got 0.2 s"),
        (["t,x,y", *ROWS[::-1]], "a step of -0.1 s, > 0 in .*line 3, got -0.1 s"),
        (["t,x,y", *ROWS, "2.0," + ROWS[0].partition(",")[2]], "no first row again: .*line 22"),
        (["t,x,y", *(f"{k},1,2" for k in range(9))], "a curve that moves"),
    ],
)  # fmt: skip
def test_a_file_that_is_no_curve_is_one_clear_error(tmp_path, lines, text):
    with pytest.raises(InvalidArgumentError, match=f"^task: expected {text}"):
        named_target(written(tmp_path, *lines))


def test_a_file_that_cannot_be_read(tmp_path):
    for path, text in ((tmp_path / "none.csv", "No such file"), (tmp_path, "Is a directory")):
        with pytest.raises(InvalidArgumentError, match=f"one of van_der_pol, .*{text}"):
            read_curve(path)
    (tmp_path / "latin.csv").write_bytes(b"t,\xe9,x\n")
    with pytest.raises(InvalidArgumentError, match=r"latin\.csv: .*can't decode"):
        read_curve(tmp_path / "latin.csv")


@one_file
@given(st.data())
def test_a_damaged_file_is_one_error_or_still_a_curve(tmp_path, data):
    whole = "\n".join(["time,x,y", *ROWS]).encode()
    at = data.draw(st.integers(0, len(whole) - 1))
    gone = data.draw(st.integers(0, 60))
    put = data.draw(st.one_of(st.binary(max_size=8), st.sampled_from(
        [b"\0", b'"', b",", b"\n", b"-", b"e300", b"1e-320", b"9" * 400, "\u0663".encode()]
    )))  # fmt: skip
    path = tmp_path / "circle.csv"
    path.write_bytes(whole[:at] + put + whole[at + gone :])
    said = ""
    try:
        goal = named_target(str(path))
    except InvalidArgumentError as error:
        said = str(error)
    else:
        assert np.isfinite(goal.orbit(100)).all()
    assert re.fullmatch(r"(task: expected .*circle\.csv.*)?", said, re.S)
    assert len(said) < 400


@pytest.mark.parametrize(
    ("file", "name"), [("my curve (1).csv", "my_curve_1_"), ("A-b_2.CSV", "A-b_2")]
)
def test_names_are_safe(tmp_path, file, name):
    assert named_target(written(tmp_path, "t,x,y", *ROWS, name=file)).name == name


@pytest.mark.parametrize("name", ["quadratic", "trot", "all"])
def test_a_name_of_mcmjs_is_refused(tmp_path, name):
    with pytest.raises(InvalidArgumentError, match=f"task: expected another name than .* {name}"):
        named_target(written(tmp_path, "t,x,y", *ROWS, name=f"{name}.csv"))


PROGRAM = """
import numpy as np
from mcmj import Target

calls = []
circle = Target("any", 2.0, lambda t: np.column_stack([np.sin(np.pi * t), np.cos(np.pi * t)]))

def made():
    calls.append(1)
    return circle

class Rooms:
    inner = circle

def line():
    return Target("line", 2.0, lambda t: np.sin(np.pi * t)[:, None])

def fails():
    raise ZeroDivisionError("by the user")

number = lambda: 3
"""


@pytest.fixture
def own_module(tmp_path, monkeypatch):
    (tmp_path / "my_targets.py").write_text(PROGRAM)
    (tmp_path / "my_broken.py").write_text("def f(:\n")
    monkeypatch.syspath_prepend(tmp_path)


@pytest.mark.parametrize("name", ["circle", "made", "Rooms.inner"])
def test_a_python_name_is_a_target_or_makes_one(own_module, name):
    goal = named_target(f"my_targets:{name}")
    assert goal.name == name.rpartition(".")[2]
    assert goal.period == 2.0
    named_target(f"my_targets:{name}")
    import my_targets

    assert len(my_targets.calls) <= 1


@pytest.mark.parametrize(
    ("task", "text"),
    [
        ("my_absent:f", "one of van_der_pol, .*my_absent:f: ModuleNotFoundError: No module named"),
        ("my_broken:f", "my_broken:f: SyntaxError: .*line 1"),
        ("my_targets:absent", "AttributeError: module 'my_targets' has no attribute 'absent'"),
        ("my_targets:fails", "my_targets:fails: ZeroDivisionError: by the user"),
        ("my_targets:calls", "TypeError: 'list' object is not callable"),
        ("my_targets:number", "a function that returns a Target, got my_targets:number: 3"),
        ("my_targets:line", "at least 2 outputs, got 1 in my_targets:line"),
        ("my_targets:", "package.module:function"),
        (":f", "package.module:function"),
    ],
)
def test_a_python_name_that_is_no_target(own_module, task, text):
    with pytest.raises(InvalidArgumentError, match=f"^task: expected .*{text}"):
        named_target(task)


def test_the_body_must_have_as_many_outputs():
    require_outputs(mcmj.random_body(0), target("quadratic"))
    with pytest.raises(
        InvalidArgumentError, match="body: expected 4 feedback channels for trot, got 2"
    ):
        require_outputs(mcmj.random_body(0), named_target("trot"))

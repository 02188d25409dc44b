"""A readout of a recording: exact relations, noise, a delay line; files that are wrong."""

import csv
import re

import numpy as np
import pytest

from mcmj.experiments.command_line import main
from mcmj.experiments.fit.config import Config
from mcmj.experiments.fit.run import run
from mcmj.targets.filter_tasks import delays
from mcmj.utils.errors import InvalidArgumentError, McmjWarning


def save(path, values, names=None):
    """A CSV file to the last bit."""
    header = names or [f"s{i}" for i in range(values.shape[1])]
    rows = [",".join(header), *(",".join(map(repr, row)) for row in values.tolist())]
    path.write_text("\n".join(rows) + "\n")
    return str(path)


@pytest.fixture
def lengths():
    """As a camera might have them: 400 samples of 6 lengths near 100."""
    return 100 + np.random.default_rng(0).normal(size=(400, 6))


def recorded(folder, signals, targets, **given):
    return Config(save(folder / "s.csv", signals), save(folder / "t.csv", targets), **given)


def test_a_linear_relation_is_found_and_runs_in_readout_csv(tmp_path, lengths):
    weights = np.random.default_rng(1).normal(size=(6, 2))
    targets = lengths @ weights + [3.0, -4.0]
    config = recorded(tmp_path, lengths, targets)
    main(["fit", "--signals", config.signals, "--targets", config.targets, "--quiet", "--out",
          str(tmp_path / "out")])  # fmt: skip
    with (tmp_path / "out" / "readout.csv").open() as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["signal", "s0", "s1"]
    assert [row[0] for row in rows[1:]] == [f"s{i}" for i in range(6)] + ["bias"]
    found = np.array([row[1:] for row in rows[1:]], dtype=float)
    assert found[:6] == pytest.approx(weights, abs=1e-11)
    assert found[6] == pytest.approx([3.0, -4.0], abs=1e-9)
    result = run(config)
    assert result.metrics["test_nrmse_std"] < 1e-12
    assert (result.fit.rows, len(result.wanted)) == (300, 100)
    assert result.rank == 6


def test_noise_has_an_error_of_1(tmp_path, lengths):
    """A little more: 7 of 300 degrees of freedom are spent on it, sqrt(1 + 7 / 300)."""
    noise = np.random.default_rng(2).normal(size=(400, 1))
    metrics = run(recorded(tmp_path, lengths, noise)).metrics
    assert metrics["test_nrmse_std"] == pytest.approx(1.0, abs=0.05)
    assert metrics["train_nrmse_std"] < 1.0


def test_the_washout_is_left_out(tmp_path, lengths):
    targets = lengths[:, :1].copy()
    targets[:50] = 0.0
    assert run(recorded(tmp_path, lengths, targets)).metrics["test_nrmse_std"] > 1e-3
    assert run(recorded(tmp_path, lengths, targets, washout=50)).metrics["test_nrmse_std"] < 1e-12


def test_the_rank_counts_what_moves_more_than_the_resolution(tmp_path):
    rng = np.random.default_rng(3)
    moves = rng.normal(size=(400, 3)) * [1.0, 0.1, 1e-3]
    turn, _ = np.linalg.qr(rng.normal(size=(5, 5)))
    result = run(recorded(tmp_path, 7 + moves @ turn[:3], moves[:, :1], resolution=0.01, bias=True))
    assert result.rank == 3
    assert result.metrics["rank_above_resolution"] == 2
    assert result.spectrum[:3] == pytest.approx([1.0, 0.1, 1e-3], rel=0.1)


@pytest.mark.parametrize("hold", [1, 3])
def test_a_delay_line_has_its_capacities(tmp_path, hold):
    """5 taps of independent inputs: one unit a delay; what it recalls, the baseline does too."""
    u = np.random.default_rng(4).uniform(2.0, 5.0, (1000, 1))
    taps = np.repeat(delays(u, 5) @ np.random.default_rng(5).normal(size=(5, 5)), hold, axis=0)
    inputs = np.repeat(u, hold, axis=0)
    wanted = delays(inputs, 2, 3 * hold)[:, 1:]
    config = recorded(
        tmp_path, taps, wanted, hold=hold, inputs=save(tmp_path / "u.csv", inputs),
        washout=10 * hold, max_delays=(8, 2),
    )  # fmt: skip
    metrics = run(config).metrics
    assert metrics["memory_by_delay"][:5] == pytest.approx(np.ones(5), abs=1e-10)
    assert metrics["memory_capacity"] == pytest.approx(4.0, abs=0.05)
    assert metrics["information_processing_capacity"] == pytest.approx(5.0, abs=0.05)
    assert metrics["test_nrmse_std"] < 1e-12
    assert metrics["baseline_test_nrmse_std"] < 1e-12
    assert abs(metrics["input_autocorrelation"]) < 5 / np.sqrt(990)


def test_inputs_that_repeat_themselves_are_a_warning(tmp_path, lengths):
    config = recorded(
        tmp_path,
        lengths,
        lengths,
        inputs=save(tmp_path / "u.csv", np.sin(np.arange(400.0) / 9)[:, None]),
    )
    with pytest.warns(McmjWarning, match=r"independent inputs; .* at a delay of 1\): see --hold"):
        run(config)


def test_other_files_give_the_same_numbers(tmp_path, lengths):
    """NPY, and NPZ with a time."""
    targets = np.column_stack([lengths[:, 0] ** 2])
    times = 0.02 * np.arange(400)
    np.save(tmp_path / "s.npy", lengths)
    np.savez(tmp_path / "t.npz", time=times, square=targets)
    one = run(Config(str(tmp_path / "s.npy"), str(tmp_path / "t.npz")))
    other = run(recorded(tmp_path, lengths, targets))
    assert one.metrics["test_nrmse_std"] == other.metrics["test_nrmse_std"]
    assert (one.signal_names[2], one.target_names) == ("2", ("square_0",))
    assert np.array_equal(one.times, times[300:])


TIMED = ["time [s]", "a", "b"]


def with_cell(text, row, column):
    table = np.column_stack([np.arange(40.0), *np.random.default_rng(0).normal(size=(2, 40))])
    lines = [list(TIMED), *([repr(x) for x in line] for line in table.tolist())]
    lines[row][column] = text
    return "\n".join(",".join(line) for line in lines)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            with_cell("nan", 7, 2),
            "signals: expected finite numbers in s.csv, got nan in row 7, column 'b'",
        ),
        (with_cell("seven", 7, 1), "a number in s.csv, row 7 (line 8), column 'a', got 'seven'"),
        (with_cell("", 9, 1), "a number in s.csv, row 9 (line 10), column 'a', got ''"),
        (with_cell("1,2", 5, 1), "signals: expected 3 cells in s.csv, row 5 (line 6), got 4"),
        (with_cell("1", 0, 1), "signals: expected a header of names, then rows, in s.csv"),
        (
            with_cell("1", 40, 1) + "\n41,1,1",
            "targets: expected 41 rows, as the signals have, got 40",
        ),
        (with_cell("9", 20, 0), "targets: expected the signals' time 9 s in row 20, got 19 s"),
        ("time,a", "signals: expected a header of names, then rows, in s.csv, got time,a"),
        ("a,b\n1,2\n3,4\n", "targets: expected 2 rows, as the signals have, got 40"),
    ],
)
def test_what_is_wrong_is_said_with_its_place(tmp_path, monkeypatch, text, told):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.csv").write_text(text)
    (tmp_path / "t.csv").write_text(with_cell("0.5", 1, 1))
    with pytest.raises(InvalidArgumentError, match=re.escape(told)):
        run(Config("s.csv", "t.csv"))


def test_other_things_that_cannot_be(tmp_path, monkeypatch, lengths):
    monkeypatch.chdir(tmp_path)
    config = recorded(tmp_path, lengths, lengths)
    np.savez("o.npz", a=np.array([{}], dtype=object))
    for inputs, told in {
        "u.txt": "inputs: expected a .csv, .npy or .npz file, got u.txt",
        "u.csv": "inputs: expected a .csv, .npy or .npz file, got u.csv: No such file",
        "o.npz": "inputs: expected a .csv, .npy or .npz file, got o.npz: Object arrays cannot",
        "s.csv": "inputs: expected one column that changes, got s0, s1",
    }.items():
        with pytest.raises(InvalidArgumentError, match=re.escape(told)):
            run(Config(config.signals, config.targets, inputs))
    with pytest.raises(InvalidArgumentError, match="at least 7 rows to train on and 2 to test on"):
        run(recorded(tmp_path, lengths[:8], lengths[:8]))
    with pytest.raises(
        InvalidArgumentError,
        match="targets: expected columns that change in the held-out rows, got s0",
    ):
        run(recorded(tmp_path, lengths, np.ones((400, 1))))
    with pytest.raises(SystemExit, match=r"fit: error: signals: expected a \.csv"):
        main(["fit", "--out", "nothing", "--quiet"])
    assert not list((tmp_path / "nothing").iterdir())

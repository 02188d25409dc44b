"""The command `mcmj`: help, names, folders, what is printed, how it ends."""

import json
import subprocess
import sys

import pytest
from commands import SCRIPTS
from test_contract import TINY

import mcmj
from mcmj.experiments import command_line
from mcmj.experiments.command_line import WIDTH, main
from mcmj.experiments.registry import GROUPS, entries

QUICK = ["emulate", *TINY["emulate"].split()]


@pytest.fixture(autouse=True)
def terminal(monkeypatch, tmp_path):
    """80 columns, in an empty folder."""
    monkeypatch.setenv("COLUMNS", str(WIDTH))
    monkeypatch.chdir(tmp_path)


def process(*command):
    return subprocess.run([sys.executable, *command], capture_output=True, text=True, check=False)


@pytest.mark.parametrize("arguments", [[], ["--help"], ["-h"], ["help"]])
def test_the_overview_has_a_line_an_experiment(arguments, capsys):
    main(arguments)
    lines = [line.rstrip() for line in capsys.readouterr().out.splitlines()]
    assert lines[0].startswith("usage: mcmj EXPERIMENT")
    assert set(GROUPS) <= set(lines)
    for name, entry in entries().items():
        assert sum(line.split() == [name, *entry.line.split()] for line in lines) == 1
    assert all(len(line) <= WIDTH for line in lines)


@pytest.mark.parametrize("name", entries())
def test_the_help_of_an_experiment_fits_a_terminal(name, capsys):
    with pytest.raises(SystemExit) as caught:
        main([name, "--help"])
    assert caught.value.code == 0
    shown = capsys.readouterr().out
    assert shown.startswith(f"usage: mcmj {name} ")
    assert entries()[name].line in shown
    assert "--out" in shown
    assert "config" not in "".join(line for line in shown.splitlines() if "╭" in line)
    assert all(len(line) <= WIDTH for line in shown.splitlines())


def test_the_version(capsys):
    main(["--version"])
    assert capsys.readouterr().out == f"mcmj {mcmj.__version__}\n"


@pytest.mark.parametrize("name", ["waltz", "--out", "no.such.module", "mcmj.core.body", ""])
def test_a_wrong_name_is_one_line_with_the_choices(name):
    with pytest.raises(SystemExit) as caught:
        main([name])
    assert "\n" not in str(caught.value.code)
    assert f"error: unknown experiment {name!r}; valid choices: {', '.join(sorted(entries()))}" in (
        str(caught.value.code)
    )


def test_a_wrong_name_ends_with_status_1():
    done = process("-m", "mcmj", "waltz")
    assert (done.returncode, done.stdout) == (1, "")
    assert len(done.stderr.splitlines()) == 1


def test_module_and_script_are_the_command():
    for command in (["-m", "mcmj", "emulate"], [SCRIPTS / "emulate.py"]):
        done = process(*command, "--help")
        assert done.returncode == 0, done.stderr
        assert done.stdout.startswith("usage: mcmj emulate ")


def test_results_lie_in_a_folder_named_by_the_options(tmp_path, capsys):
    main(QUICK)
    (folder,) = (tmp_path / "results").iterdir()
    wanted = "emulate-targets=van_der_pol-integrators=Euler-steps_ms=1.0+2.0-horizon=1.0"
    assert folder.name == wanted
    assert (folder / "metrics.json").is_file()
    assert "results in" in capsys.readouterr().out


def test_json_is_all_that_is_on_stdout(tmp_path, capsys):
    main([*QUICK, "--json", "--out", "there"])
    shown = json.loads(capsys.readouterr().out)
    assert shown == json.loads((tmp_path / "there/metrics.json").read_text())["metrics"]


def test_an_interrupt_ends_with_status_130(monkeypatch, capsys):
    def interrupted(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(command_line, "carry_out", interrupted)
    with pytest.raises(SystemExit) as caught:
        main(QUICK)
    assert caught.value.code == 130
    assert capsys.readouterr().err == "emulate: interrupted; nothing half-written is left\n"


def test_a_refused_option_is_named_and_nothing_is_written(tmp_path, capsys):
    for options in (["--horizon", "-1"], ["--horizon", "x"], ["--horizons", "1"]):
        with pytest.raises(SystemExit) as caught:
            main(["emulate", *options])
        assert caught.value.code not in (0, None)
        assert "horizon" in capsys.readouterr().err + str(caught.value.code)
    assert not list(tmp_path.iterdir())

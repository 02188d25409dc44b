"""The README's example prints what the README says."""

import re
import subprocess
import sys
from pathlib import Path

README = Path(__file__).parent.parent / "README.md"


def test_example_prints_the_result_shown(tmp_path):
    code, shown = re.search(
        r"```python\n(.*?)```\s*```text\n(.*?)```", README.read_text(), re.S
    ).groups()
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == shown.strip()
    assert (tmp_path / "body.xml").stat().st_size > 10_000


def test_commands_exist():
    scripts = re.findall(r"sh scripts/run\.sh (\w+)", README.read_text())
    assert {"limit_cycle", "test"} <= set(scripts)
    for name in set(scripts) - {"test"}:
        assert (README.parent / "scripts" / f"{name}.py").is_file(), name


def test_first_two_commands_run_the_main_job_and_the_tests():
    commands = re.findall(r"^(sh scripts/run\.sh \w+)", README.read_text(), re.M)
    assert commands[:2] == ["sh scripts/run.sh limit_cycle", "sh scripts/run.sh test"]

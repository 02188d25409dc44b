"""The examples of README and docs print what is shown; commands, files and links exist."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
README = ROOT / "README.md"
PAGES = [README, *sorted((ROOT / "docs").rglob("*.md"))]
EXAMPLE = re.compile(r"```python\n(.*?)```\s*```text\n(.*?)```", re.S)
EXAMPLES = [
    pytest.param(code, shown, id=f"{page.stem}-{number}")
    for page in PAGES
    for number, (code, shown) in enumerate(EXAMPLE.findall(page.read_text()))
]


@pytest.mark.parametrize(("code", "shown"), EXAMPLES)
def test_examples_print_the_results_shown(code, shown, tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == shown.strip()
    for written in re.findall(r'open\("(.*?)", "w"\)', code):
        assert (tmp_path / written).stat().st_size > 1000


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_commands_and_linked_files_exist(page):
    text = page.read_text()
    for name in set(re.findall(r"^(?:sh scripts/run\.sh|mcmj) (\w+)", text, re.M)) - {"test"}:
        assert (ROOT / "scripts" / f"{name}.py").is_file(), name
    for link in re.findall(r"\]\(([^)#]+)\)", text):
        assert link.startswith("http") or (page.parent / link).exists(), link


def test_the_tests_of_the_promises_exist():
    page = (ROOT / "docs" / "reliability.md").read_text()
    for row in re.findall(r"^\|.*\|$", page, re.M)[2:]:
        path = None
        named = re.findall(r"`(tests/[\w/]+\.py)?(?:::(\w+))?`", row.split("|")[3])
        assert named, row
        for file, test in named:
            path = ROOT / file if file else path
            assert not test or f"def {test}(" in path.read_text(), (row, test)


def test_first_two_commands_run_the_main_job_and_the_tests():
    commands = re.findall(r"^(sh scripts/run\.sh \w+)", README.read_text(), re.M)
    assert commands[:2] == ["sh scripts/run.sh limit_cycle", "sh scripts/run.sh test"]

"""The programs of docs/guide/python.md run."""

import pathlib
import re
import subprocess
import sys

import pytest

PAGE = pathlib.Path(__file__).resolve().parents[3] / "docs/guide/python.md"
PROGRAMS = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.S)


@pytest.mark.parametrize("program", PROGRAMS, ids=[
    "first ray", "deforming loop", "all hits", "insides and distances", "Open3D", "trimesh",
    "two scenes"])
def test_program_runs(program, tmp_path):
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True,
                          text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout

"""The programs of docs/guide/python.md and sensors.md run."""

import pathlib
import re
import subprocess
import sys

import pytest

GUIDE = pathlib.Path(__file__).resolve().parents[3] / "docs/guide"
PROGRAMS = re.findall(r"```python\n(.*?)```", (GUIDE / "python.md").read_text() +
                      (GUIDE / "sensors.md").read_text(), re.S)


@pytest.mark.parametrize("program", PROGRAMS, ids=[
    "first ray", "deforming loop", "bodies", "all hits", "insides and distances", "many views", "Open3D",
    "trimesh", "two scenes", "cameras", "lidar", "other bodies"])
def test_program_runs(program, tmp_path):
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True,
                          text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout

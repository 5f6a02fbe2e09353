"""The programs of library/examples/ run, with the same bits on every device and thread."""

import pathlib
import subprocess
import sys

import pytest

EXAMPLES = pathlib.Path(__file__).resolve().parents[3] / "library/examples"


def digest_of(program, *arguments):
    return subprocess.run([sys.executable, EXAMPLES / program, *arguments], capture_output=True,
                          text=True, check=True).stdout.split()[0]


@pytest.mark.parametrize("program, small", [
    ("depth_cameras.py", ["--steps", "3", "--cameras", "5", "--size", "24"]),
    ("lidar.py", ["--sweeps", "2", "--updates", "3", "--columns", "50"])])
def test_example(program, small):
    digests = {digest_of(program, *small, *how) for how in [
        ["--threads", "1"], ["--threads", "2"], ["--device", "brute"]]}
    assert len(digests) == 1 and len(digests.pop()) == 32


def test_the_first_crossing_is_the_same_everywhere():
    command = [sys.executable, EXAMPLES / "folding.py", "--rows", "60", "--frames", "30"]
    texts = {subprocess.run([*command, *how], capture_output=True, text=True, check=True).stdout
             for how in (["--threads", "1"], ["--threads", "2"], ["--device", "brute"])}
    assert len(texts) == 1 and texts.pop().startswith("frame ")

"""The program library/examples/lidar.py runs, with the same bits on every device and thread."""

import pathlib
import subprocess
import sys

PROGRAM = pathlib.Path(__file__).resolve().parents[3] / "library/examples/lidar.py"


def test_lidar():
    small = ["--sweeps", "2", "--updates", "3", "--columns", "50"]
    digests = {subprocess.run([sys.executable, PROGRAM, *small, *how], capture_output=True, text=True,
                              check=True).stdout.split()[0]
               for how in [["--threads", "1"], ["--threads", "2"], ["--device", "brute"]]}
    assert len(digests) == 1 and len(digests.pop()) == 32

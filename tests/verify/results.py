"""Results of stages, kept in a JSON file for each state of the checkout."""

import dataclasses
import hashlib
import json
import os
import pathlib
import platform
import subprocess
import tempfile

FINISHED = ("pass", "fail")


@dataclasses.dataclass
class Result:
    """How a stage ended: pass, fail, cannot (run here) or interrupted."""

    name: str
    state: str
    # The reason; for a stage that passed, the last line that it printed.
    reason: str
    command: str
    # UTC, as 2026-11-25T02:10:00.000Z.
    begun: str
    seconds: float
    log: str
    commit: str
    # A hash of what is not committed; empty if nothing is.
    changes: str


def state_of(root: pathlib.Path) -> tuple[str, str]:
    """Returns the commit of a checkout and Result.changes."""

    def git(*arguments: str) -> bytes:
        return subprocess.run(["git", *arguments], cwd=root, check=True, stdout=subprocess.PIPE,
                              stderr=subprocess.DEVNULL).stdout

    commit = git("rev-parse", "HEAD").decode().strip()
    changed = git("diff", "--binary", "HEAD")
    new = git("ls-files", "-z", "--others", "--exclude-standard").split(b"\0")[:-1]
    if not changed and not new:
        return commit, ""
    text = hashlib.sha256(changed)
    for name in new:
        path = root / os.fsdecode(name)
        text.update(b"\0" + name + b"\0" + (path.read_bytes() if path.is_file() else b""))
    return commit, text.hexdigest()[:12]


def machine() -> dict[str, object]:
    system = platform.freedesktop_os_release().get("PRETTY_NAME", "")
    return {"system": system, "kernel": platform.release(), "processor": platform.machine(),
            "cores": len(os.sched_getaffinity(0))}


class Results:
    """The results of one state of a checkout, in FOLDER/COMMIT[-CHANGES]/results.json."""

    def __init__(self, folder: pathlib.Path, commit: str, changes: str) -> None:
        self.commit = commit
        self.changes = changes
        self.folder = folder / "-".join(filter(None, (commit, changes)))
        self.file = self.folder / "results.json"
        self.of = {result.name: result for result in _read(self.file)}

    def add(self, result: Result) -> None:
        """Keeps the result in place of an earlier one of that stage. The file is replaced as a whole."""
        self.of[result.name] = result
        self.folder.mkdir(parents=True, exist_ok=True)
        text = json.dumps({"commit": self.commit, "changes": self.changes, "machine": machine(),
                           "stages": [dataclasses.asdict(kept) for kept in self.of.values()]}, indent=2)
        with tempfile.NamedTemporaryFile("w", dir=self.folder, delete=False) as file:
            file.write(text + "\n")
        os.replace(file.name, self.file)


def _read(file: pathlib.Path) -> list[Result]:
    """Returns none if there is no such file, or another program wrote it."""
    try:
        return [Result(**stage) for stage in json.loads(file.read_text())["stages"]]
    except (OSError, ValueError, KeyError, TypeError):
        return []


def last_of_each(folder: pathlib.Path) -> dict[str, Result]:
    """Returns each stage's last result of any commit."""
    kept = [result for file in folder.glob("*/results.json") for result in _read(file)]
    return {result.name: result for result in sorted(kept, key=lambda result: result.begun)}

"""Runs stages one after the other, and says how they end."""

import dataclasses
import datetime
import os
import pathlib
import signal
import subprocess
import sys
import time

from results import FINISHED, Result, Results, last_of_each, state_of

# The exit code of scripts and programs that lack packages or a device (docs/guide/exit_codes.md).
UNAVAILABLE = 4
ENDING_SIGNALS = (signal.SIGHUP, signal.SIGINT, signal.SIGTERM)
# Seconds that an interrupted stage has to end by itself.
GRACE = 10


@dataclasses.dataclass(frozen=True)
class Stage:
    name: str
    what: str
    # On two cores, with the builds of a new checkout.
    minutes: float
    # Lines of bash, run at the root of the checkout with the functions of cmake/setup.sh.
    command: str
    # Kinds in cmake/packages.txt that are installed before.
    packages: str = ""
    # Further needs, for --list.
    needs: str = ""
    # Whether `minutes` come from a run; otherwise they are an estimate.
    is_measured: bool = True


class Interrupted(Exception):
    """A signal that ends the program."""


def raise_interrupted(number: int, _: object) -> None:
    raise Interrupted(number)


def script_of(stage: Stage, install: bool) -> str:
    lines = ["set -euo pipefail"]
    if stage.packages:
        lines += ["root=$PWD", ". cmake/setup.sh", 'mkdir -p "$build"',
                  f"install_missing {'yes' if install else 'no'} {stage.packages}",
                  # build_release TARGET...: builds targets of the preset that ./test builds.
                  'build_release() { build_targets=("$@"); set_up yes ON build test; }']
    return "\n".join([*lines, stage.command])


def last_line(log: pathlib.Path) -> str:
    with log.open("rb") as file:
        file.seek(max(0, log.stat().st_size - 4096))
        lines = file.read().decode(errors="replace").split("\n")
    # On a terminal, a line that is overwritten ends with a carriage return.
    return next((line.split("\r")[-1].strip() for line in reversed(lines) if line.strip()), "")


def wait(process: "subprocess.Popen[bytes]", stage: Stage, log: pathlib.Path,
         deadline: float) -> int | None:
    """Returns the exit code; None if the deadline passes before. Shows the last line on a terminal."""
    begin = time.monotonic()
    shown = 0.0
    try:
        while process.poll() is None:
            now = time.monotonic()
            if now >= deadline:
                return None
            if sys.stderr.isatty() and now >= shown + 1:
                shown = now
                text = f"{stage.name}, {int(now - begin)} s: {last_line(log)}"
                print(f"\r\33[K{text[:os.get_terminal_size(2).columns - 1]}", end="", file=sys.stderr,
                      flush=True)
            time.sleep(0.05)
        return process.returncode
    finally:
        if shown:
            print("\r\33[K", end="", file=sys.stderr, flush=True)


def end(process: "subprocess.Popen[bytes]") -> None:
    """Ends a stage with all processes of its group. Another signal does not disturb this."""
    for number in ENDING_SIGNALS:
        signal.signal(number, signal.SIG_IGN)
    for number in (signal.SIGTERM, signal.SIGKILL):
        try:
            os.killpg(process.pid, number)
            process.wait(GRACE)
        except (ProcessLookupError, subprocess.TimeoutExpired):
            pass


def run_stage(root: pathlib.Path, results: Results, stage: Stage, install: bool,
              deadline: float) -> Result:
    """Runs a stage and keeps its result. Passes Interrupted on, with a result that says so."""
    results.folder.mkdir(parents=True, exist_ok=True)
    log = results.folder / f"{stage.name}.log"
    now = datetime.datetime.now(datetime.timezone.utc)
    begun = now.isoformat(timespec="milliseconds").replace("+00:00", "Z")
    begin = time.monotonic()
    result = Result(stage.name, "interrupted", "interrupted", stage.command, begun, 0,
                    str(log.relative_to(root)), results.commit, results.changes)
    # A signal waits until the process that it has to end is known.
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, ENDING_SIGNALS)
    with log.open("wb") as output:
        process = subprocess.Popen(["bash", "-c", script_of(stage, install)], cwd=root,
                                   stdin=subprocess.DEVNULL, stdout=output, stderr=output,
                                   start_new_session=True,
                                   preexec_fn=lambda: signal.pthread_sigmask(signal.SIG_SETMASK, mask))
    try:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        code = wait(process, stage, log, deadline)
        said = last_line(log).removeprefix("morphray: ")
        if code is None:
            result.reason = "the time was over"
        elif state_of(root) != (results.commit, results.changes):
            result.reason = "files of the checkout changed while it ran"
        elif code == UNAVAILABLE:
            result.state, result.reason = "cannot", said
        else:
            result.state = "pass" if code == 0 else "fail"
            result.reason = said if code == 0 else f"exit code {code}: {said}"
        return result
    finally:
        result.seconds = round(time.monotonic() - begin, 1)
        if process.poll() is None:
            end(process)
        results.add(result)


def expected_minutes(stage: Stage, last: dict[str, Result]) -> float:
    known = last.get(stage.name)
    return max(stage.minutes, known.seconds / 60 if known else 0)


def next_stage(stages: list[Stage], last: dict[str, Result], minutes: float) -> Stage | None:
    """Returns the stage that was run longest ago, of those that end within the minutes."""
    fitting = [stage for stage in stages if expected_minutes(stage, last) <= minutes]

    def begun(stage: Stage) -> str:
        known = last.get(stage.name)
        return known.begun if known and known.state != "interrupted" else ""

    return min(fitting, key=begun) if fitting else None


def show(result: Result, is_kept: bool = False) -> None:
    states = {"pass": "pass", "fail": "FAIL", "cannot": "cannot run here, because",
              "interrupted": "interrupted"}
    kept = f", kept from {result.begun[:16]}" if is_kept else ""
    print(f"{result.name}: {states[result.state]}{kept}: {result.reason}", flush=True)


def run_all(root: pathlib.Path, results: Results, stages: list[Stage], install: bool, again: bool,
            done: list[Stage]) -> None:
    """Runs the stages that have not finished for this state of the checkout; with `again` each."""
    for stage in stages:
        if state_of(root) != (results.commit, results.changes):
            print("files of the checkout changed; start ./verify again", flush=True)
            return
        done.append(stage)
        known = results.of.get(stage.name)
        if known and known.state in FINISHED and not again:
            show(known, is_kept=True)
            continue
        print(f"{stage.name}: about {stage.minutes:g} minutes on two cores", flush=True)
        show(run_stage(root, results, stage, install, float("inf")))


def run_minutes(root: pathlib.Path, results: Results, stages: list[Stage], install: bool,
                minutes: float, done: list[Stage]) -> None:
    """Runs for the minutes, each stage once, first the one that was run longest ago."""
    deadline = time.monotonic() + 60 * minutes
    last = last_of_each(results.folder.parent)
    while stage := next_stage([stage for stage in stages if stage not in done], last,
                              (deadline - time.monotonic()) / 60):
        if state_of(root) != (results.commit, results.changes):
            print("files of the checkout changed; start ./verify again", flush=True)
            return
        done.append(stage)
        print(f"{stage.name}: about {expected_minutes(stage, last):.3g} minutes on two cores", flush=True)
        show(run_stage(root, results, stage, install, deadline))

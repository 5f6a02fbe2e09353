"""The runner of ./verify, with stages that are made for it."""

import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import results
import runner
from stages import STAGES

HERE = pathlib.Path(__file__).resolve().parent
# Runs the command line of ./verify with the stages that it is given.
PROGRAM = f"""
import json, pathlib, runpy, sys
sys.dont_write_bytecode = True
sys.path.insert(0, {str(HERE)!r})
from runner import Stage
main = runpy.run_path({str(HERE / "run")!r})["main"]
stages = [Stage(*stage) for stage in json.loads(sys.argv[2])]
sys.exit(main(sys.argv[3:], stages, pathlib.Path(sys.argv[1])))
"""


class Verify(unittest.TestCase):
    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        (self.root / ".gitignore").write_text("/build/\n/runs\n")
        self.git("init", "-q")
        self.commit()

    def git(self, *arguments: str) -> str:
        person = ["-c", "user.name=a", "-c", "user.email=a@example.org"]
        return subprocess.run(["git", *person, *arguments], cwd=self.root, check=True, text=True,
                              capture_output=True).stdout.strip()

    def commit(self) -> None:
        self.git("add", "-A")
        self.git("commit", "-q", "--allow-empty", "-m", "a commit")

    def start(self, stages: dict[str, str], *arguments: str,
              minutes: float = 0.0001) -> "subprocess.Popen[str]":
        """Starts ./verify. Each stage first writes its name into the file `runs`."""
        made = [(name, "a stage", minutes, f"echo {name} >>runs\n{command}")
                for name, command in stages.items()]
        return subprocess.Popen(
            [sys.executable, "-c", PROGRAM, str(self.root), json.dumps(made), *arguments],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def run_verify(self, stages: dict[str, str], *arguments: str,
                   minutes: float = 0.0001) -> tuple[int, str]:
        process = self.start(stages, *arguments, minutes=minutes)
        output, _ = process.communicate(timeout=100)
        return process.returncode, output

    def runs(self) -> list[str]:
        """Returns the stages that ran since the last call, in order."""
        file = self.root / "runs"
        names = file.read_text().split() if file.exists() else []
        file.unlink(missing_ok=True)
        return names

    def kept(self) -> dict[str, dict[str, object]]:
        commit, changes = results.state_of(self.root)
        file = results.Results(self.root / "build/verify", commit, changes).file
        return {stage["name"]: stage for stage in json.loads(file.read_text())["stages"]}

    def test_says_how_stages_end(self) -> None:
        stages = {"good": "echo 3 checks", "bad": "echo 1 differs; exit 1",
                  "no": "echo 'morphray: needs root' >&2; exit 4"}
        code, output = self.run_verify(stages)
        self.assertEqual(code, 1, output)
        self.assertIn("good: pass: 3 checks", output)
        self.assertIn("bad: FAIL: exit code 1: 1 differs", output)
        self.assertIn("no: cannot run here, because: needs root", output)
        self.assertIn("1 passed, 1 failed, 1 cannot run here, 0 interrupted", output)
        kept = self.kept()
        self.assertEqual([stage["state"] for stage in kept.values()], ["pass", "fail", "cannot"])
        self.assertEqual(kept["bad"]["commit"], self.git("rev-parse", "HEAD"))
        self.assertEqual((self.root / str(kept["bad"]["log"])).read_text(), "1 differs\n")
        self.assertEqual(self.run_verify(stages, "good")[0], 0)
        self.assertEqual(self.run_verify(stages, "no", "good")[0], 4)

    def test_a_line_that_fails_within_a_stage_fails_it(self) -> None:
        self.assertEqual(self.run_verify({"bad": "false | true\ntrue"})[0], 1)
        self.assertEqual(self.run_verify({"worse": "kill -SEGV $$"})[0], 1)

    def test_runs_stages_in_the_order_given(self) -> None:
        stages = {"a": "true", "b": "true", "c": "true"}
        self.run_verify(stages, "c", "a", "c")
        self.assertEqual(self.runs(), ["c", "a"])

    def test_refuses_what_it_does_not_know(self) -> None:
        for arguments in (["z"], ["--minutes", "0"], ["--minutes", "nan"], ["--minute", "1"]):
            code, output = self.run_verify({"a": "true"}, *arguments)
            self.assertEqual(code, 2, output)
        self.assertEqual(self.runs(), [])

    def test_goes_on_where_it_was_interrupted(self) -> None:
        stages = {"a": "true", "b": "[ -e build/ready ] || sleep 100", "c": "exit 1", "no": "exit 4"}
        process = self.start(stages)
        self.wait_for("b")
        process.send_signal(signal.SIGINT)
        output, _ = process.communicate(timeout=30)
        self.assertEqual(process.returncode, 130, output)
        self.assertIn("not run: c no", output)
        self.assertEqual(self.runs(), ["a", "b"])
        self.assertEqual(self.kept()["a"]["state"], "pass")
        self.assertEqual(self.kept()["b"]["state"], "interrupted")
        (self.root / "build/ready").touch()
        code, output = self.run_verify(stages)
        self.assertEqual(code, 1, output)
        self.assertEqual(self.runs(), ["b", "c", "no"])
        self.assertIn("a: pass, kept from", output)
        # A stage that cannot run here may do so later; one that failed fails again.
        self.run_verify(stages)
        self.assertEqual(self.runs(), ["no"])
        self.run_verify(stages, "--again")
        self.assertEqual(self.runs(), ["a", "b", "c", "no"])

    def wait_for(self, name: str) -> None:
        """Waits until a stage has begun."""
        file = self.root / "runs"
        for _ in range(3000):
            if file.exists() and name in file.read_text().split():
                return
            time.sleep(0.02)
        self.fail(f"{name} does not begin")

    def wait_for_end(self, process: int) -> None:
        """Waits until a process has ended. On a busy machine one that is killed lives on for a while."""
        for _ in range(500):
            try:
                if "zombie" in pathlib.Path(f"/proc/{process}/status").read_text():
                    return
            except (FileNotFoundError, ProcessLookupError):
                return
            time.sleep(0.02)
        self.fail(f"process {process} lives on")

    def test_signals_leave_no_process_behind(self) -> None:
        for number in (signal.SIGTERM, signal.SIGHUP):
            process = self.start({"a": "sleep 100 & echo $! >build/child; wait"}, "--again")
            self.wait_for("a")
            child = self.root / "build/child"
            while not child.exists() or not child.read_text():
                time.sleep(0.02)
            process.send_signal(number)
            self.assertIn("1 interrupted", process.communicate(timeout=30)[0])
            self.assertEqual(process.returncode, 128 + number)
            self.wait_for_end(int(child.read_text()))
            child.unlink()
            self.runs()

    def test_results_belong_to_the_files_of_the_checkout(self) -> None:
        stages = {"a": "true"}
        self.run_verify(stages)
        (self.root / "new").write_text("1")
        self.run_verify(stages)
        self.run_verify(stages)
        self.assertEqual(self.runs(), ["a", "a"])
        self.assertNotEqual(self.kept()["a"]["changes"], "")
        self.commit()
        self.run_verify(stages)
        (self.root / "new").write_text("2")
        self.run_verify(stages)
        self.git("checkout", "-q", "new")
        self.run_verify(stages)
        self.assertEqual(self.runs(), ["a", "a"])

    def test_a_stage_over_files_that_change_has_no_result(self) -> None:
        code, output = self.run_verify({"a": "echo 1 >new", "b": "true"})
        self.assertEqual(code, 1, output)
        self.assertIn("a: interrupted: files of the checkout changed", output)
        self.assertEqual(self.runs(), ["a"])

    def test_minutes_are_filled_with_what_was_run_longest_ago(self) -> None:
        stages = {"a": "true", "b": "true", "c": "true", "no": "exit 4"}
        self.run_verify(stages, "b")
        self.run_verify(stages, "a")
        self.runs()
        self.commit()
        code, output = self.run_verify(stages, "--minutes", "1")
        self.assertEqual(code, 4, output)
        self.assertEqual(self.runs(), ["c", "no", "b", "a"])
        code, output = self.run_verify(stages, "--minutes", "1", "a", "b")
        self.assertEqual(self.runs(), ["b", "a"])

    def test_minutes_begin_no_stage_that_takes_longer(self) -> None:
        code, output = self.run_verify({"a": "true"}, "--minutes", "0.5", minutes=0.6)
        self.assertEqual(code, 0, output)
        self.assertEqual(self.runs(), [])

    def test_minutes_end_a_stage_that_takes_longer_than_it_says(self) -> None:
        stages = {"a": "sleep 1000", "b": "true"}
        code, output = self.run_verify(stages, "--minutes", "0.1", "a")
        self.assertEqual(code, 0, output)
        self.assertIn("a: interrupted: the time was over", output)
        self.assertEqual(self.runs(), ["a"])
        # The next time it is known to take that long.
        self.run_verify(stages, "--minutes", "0.05")
        self.assertEqual(self.runs(), ["b"])

    def test_one_at_a_time(self) -> None:
        process = self.start({"a": "sleep 100"})
        self.wait_for("a")
        code, output = self.run_verify({"a": "true"})
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=30)
        self.assertEqual(code, 5)
        self.assertIn("another ./verify runs", output)

    def test_results_that_cannot_be_written_are_an_error_of_one_line(self) -> None:
        (self.root / "build").write_text("a file")
        code, output = self.run_verify({"a": "true"})
        self.assertEqual(code, 5)
        self.assertEqual(len(output.splitlines()), 1, output)

    def test_list_says_how_stages_ended_last(self) -> None:
        self.run_verify({"a": "exit 1", "b": "true"}, "a")
        _, output = self.run_verify({"a": "exit 1", "b": "true"}, "--list")
        self.assertEqual(output.count("last fail"), 1, output)
        self.assertNotIn("last pass", output)

    def test_a_reader_of_the_list_may_stop(self) -> None:
        process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM, str(self.root), json.dumps([("a", "a stage", 1, "true")] * 2000),
             "--list"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        assert process.stdout and process.stderr
        process.stdout.close()
        self.assertEqual(process.stderr.read(), "")
        process.stderr.close()
        self.assertEqual(process.wait(), -signal.SIGPIPE)


class Stages(unittest.TestCase):
    root = HERE.parents[1]

    def test_have_names_of_their_own(self) -> None:
        names = [stage.name for stage in STAGES]
        self.assertEqual(len(names), len(set(names)))

    def test_need_kinds_of_packages_that_are_listed(self) -> None:
        listed = (self.root / "cmake/packages.txt").read_text().splitlines()
        kinds = {line.split()[0] for line in listed if line and not line.startswith("#")}
        for stage in STAGES:
            self.assertLessEqual(set(stage.packages.split()), kinds, stage.name)

    def test_call_scripts_that_exist_in_lines_that_bash_reads(self) -> None:
        for stage in STAGES:
            text = runner.script_of(stage, True)
            subprocess.run(["bash", "-n", "-c", text], check=True)
            for word in stage.command.split():
                if word.endswith("/run") or word.startswith("./"):
                    self.assertTrue(os.access(self.root / word, os.X_OK), word)


if __name__ == "__main__":
    unittest.main()

"""A copy of the checkout in which mutations are built and tested."""

import dataclasses
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import tempfile
import time

# Optimised, without asserts, and for one instruction set, which takes a quarter of the time.
CONFIGURE = [
    "-DCMAKE_BUILD_TYPE=Release",
    "-DCMAKE_C_COMPILER=clang",
    "-DCMAKE_CXX_COMPILER=clang++",
    "-DCMAKE_CXX_FLAGS_RELEASE=-O1 -DNDEBUG -w",
    "-DMORPHRAY_PYTHON=OFF",
    "-DMORPHRAY_VIEW=OFF",
]
# Disables Highway's targets but bit 9 (AVX2) and bit 62 (HWY_SCALAR), and enables the instructions that
# Highway takes AVX2 to come with.
ONE_TARGET = [
    "-DMORPHRAY_DISABLED_TARGETS=0x3ffffffffffffdff",
    "-DCMAKE_CXX_FLAGS=-march=haswell -maes -mpclmul",
]
MEMORY = 12 << 30
LEAST_TIMEOUT = 60


@dataclasses.dataclass(frozen=True)
class Test:
    """A program and its arguments; @NAME in them is replaced by files of the copy."""

    target: str
    arguments: tuple[str, ...]

    def name(self) -> str:
        return " ".join((self.target, *self.arguments))


# The tests of each prefix of a path, in the order in which they run.
Suites = dict[str, list[Test]]


def read_suites(path: pathlib.Path) -> Suites:
    suites: Suites = {}
    tests: list[Test] = []
    for line in path.read_text().splitlines():
        if not line or line.startswith("#"):
            continue
        if line.startswith(" "):
            target, *arguments = line.split()
            tests.append(Test(target, tuple(arguments)))
        else:
            tests = suites.setdefault(line, [])
    return suites


def check_suites(suites: Suites, files: set[str], root: pathlib.Path) -> list[str]:
    """Returns a line for each mutated file without a test, and for each test of which no
    CMakeLists.txt makes the program."""
    lists = "\n".join(path.read_text() for folder in ("tests", "proofs")
                      for path in (root / folder).rglob("CMakeLists.txt"))
    made = set(re.findall(r"(?:add_executable\(|proof_program\(|\(NAME |set\(test )([\w${}]+)", lists))
    # `test` may have a variable in it, such as a version.
    patterns = [re.sub(r"\$\{\w+\}", r"\\w+", name) for name in made if not name.startswith("$")]
    names = re.compile("|".join(patterns))
    untested = [file for file in sorted(files) if not any(map(file.startswith, suites))]
    return [f"suites.txt: no test for {file}" for file in untested] + [
        f"suites.txt: no program {test.target} for {prefix}"
        for prefix, tests in suites.items() for test in tests if not names.fullmatch(test.target)]


def tests_of(suites: Suites, file: str) -> list[Test]:
    """Returns the tests of the longest prefix of a file's path."""
    return suites[max((prefix for prefix in suites if file.startswith(prefix)), key=len)]


def files_of(root: pathlib.Path) -> list[str]:
    """Returns the files of the checkout that git does not ignore."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=root, check=True, capture_output=True, text=True).stdout
    return [name for name in listed.split("\0") if name and (root / name).is_file()]


def usual_configuration() -> list[str]:
    return CONFIGURE + (ONE_TARGET if os.uname().machine == "x86_64" else [])


class Workshop:
    """A copy of the checkout with a build of its own."""

    def __init__(self, root: pathlib.Path, folder: pathlib.Path, before: list[str],
                 configure: list[str] | None = None, memory: int = MEMORY):
        self.root = root
        self.configure = usual_configuration() if configure is None else configure
        self.memory = memory
        self.source = folder / "source"
        self.build_folder = folder / "build"
        self.scratch = folder / "scratch"
        self.before = before
        self.seconds: dict[Test, float] = {}
        self.environment = dict(
            os.environ, CCACHE_BASEDIR=str(folder), CCACHE_NOHASHDIR="1",
            GTEST_BREAK_ON_FAILURE="1")
        shutil.rmtree(self.scratch, ignore_errors=True)
        self.scratch.mkdir(parents=True, exist_ok=True)
        self._copy()
        self._configure()

    def _copy(self) -> None:
        """Makes the copy equal to the checkout, and leaves equal files as they are."""
        wanted = set(files_of(self.root))
        for name in wanted:
            target = self.source / name
            content = (self.root / name).read_bytes()
            if not target.is_file() or target.read_bytes() != content:
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_bytes(content)
                shutil.copymode(self.root / name, target)
        for path in list(self.source.rglob("*")):
            if path.is_file() and str(path.relative_to(self.source)) not in wanted:
                path.unlink()

    def _configure(self) -> None:
        command = ["cmake", "-S", str(self.source), "-B", str(self.build_folder), "-G", "Ninja",
                   *self.configure]
        if shutil.which("ccache"):
            command.append("-DCMAKE_CXX_COMPILER_LAUNCHER=ccache")
        if shutil.which("ld.lld"):
            command.append("-DCMAKE_EXE_LINKER_FLAGS=-fuse-ld=lld")
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=self.environment)

    def write(self, file: str, text: str) -> None:
        path = self.source / file
        if path.read_text() != text:
            path.write_text(text)

    def build(self, targets: list[str], jobs: int = 1, after_errors: bool = False) -> str:
        """Returns the compiler's messages if the build fails."""
        done = subprocess.run(
            [*self.before, "ninja", "-C", self.build_folder, f"-j{jobs}",
             f"-k{0 if after_errors else 1}", *targets],
            env=self.environment, capture_output=True, text=True)
        return "" if done.returncode == 0 else done.stdout + done.stderr

    def _argument(self, argument: str, folder: str) -> list[str]:
        if argument == "@out":
            return [f"{folder}/failures"]
        if argument.startswith("@"):
            return sorted(str(path) for path in self.source.glob(argument[1:]))
        return [argument]

    def run(self, test: Test, mutant: int = 0) -> tuple[str, float]:
        """Returns how the test fails, or nothing if it passes, and the seconds that it took."""
        timeout = max(LEAST_TIMEOUT, 5 * self.seconds.get(test, 600))

        def limit() -> None:
            resource.setrlimit(resource.RLIMIT_AS, (self.memory, self.memory))
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

        with tempfile.TemporaryDirectory(dir=self.scratch, ignore_cleanup_errors=True) as folder:
            arguments = [word for argument in test.arguments
                         for word in self._argument(argument, folder)]
            # The time begins when the program does, not when `before` lets it.
            started = ["bash", "-c", 'echo; exec timeout -k 5 "$0" "$@"', f"{timeout:.0f}"]
            environment = dict(self.environment, TMPDIR=folder, MORPHRAY_MUTANT=str(mutant))
            with subprocess.Popen(
                    [*self.before, *started, self.build_folder / "bin" / test.target, *arguments],
                    cwd=folder, env=environment, stdin=subprocess.DEVNULL, bufsize=0,
                    stdout=subprocess.PIPE, stderr=subprocess.STDOUT, preexec_fn=limit,
                    start_new_session=True) as process:
                assert process.stdout is not None
                process.stdout.readline()
                begin = time.monotonic()
                try:
                    output = process.communicate(timeout=timeout + 20)[0]
                    code = process.returncode
                except subprocess.TimeoutExpired:
                    # Processes that it started go on, and have its output.
                    os.killpg(process.pid, signal.SIGKILL)
                    output, code = b"", 124
                except BaseException:
                    os.killpg(process.pid, signal.SIGKILL)
                    raise
                why = "" if code == 0 else _why(code, output.decode(errors="replace"))
                return why, time.monotonic() - begin


def _why(code: int, output: str) -> str:
    """Returns the test that fails, or how the program ends."""
    if code in (124, 137):
        return "runs too long"
    running = [line for line in output.splitlines() if line.startswith("[ RUN      ] ")]
    if running:
        report = re.search("^SUMMARY: ThreadSanitizer: ([a-z -]*[a-z])", output, re.MULTILINE)
        return running[-1].removeprefix("[ RUN      ] ") + (f", {report[1]}" if report else "")
    if code < 0 or code > 128:
        return f"ends by signal {-code if code < 0 else code - 128}"
    return f"exit code {code}"

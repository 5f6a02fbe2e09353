"""The types of _morphray.pyi are those of the module, and suffice for mypy."""

import ast
import inspect
import os
import pathlib
import re
import shutil
import subprocess
import sys

import pytest

import morphray

FOLDER = pathlib.Path(morphray.__file__).parent
PAGE = pathlib.Path(__file__).resolve().parents[3] / "docs/guide/python.md"


def public(names):
    return {name for name in names if not name.startswith("_") or name == "__version__"}


def arguments_of(function, with_defaults):
    arguments = function.args
    names = [a.arg for a in arguments.args if a.arg != "self"], [a.arg for a in arguments.kwonlyargs]
    defaults = [d and ast.unparse(d) for d in arguments.defaults + arguments.kw_defaults]
    return names, with_defaults and defaults


def check_function(name, definitions, function):
    """pybind11 writes a signature, or several, into the documentation."""
    documentation = function.__doc__
    if inspect.isfunction(function):
        documentation = name + str(inspect.signature(function)) + " -> "
    signatures = re.findall(rf"^(?:\d+\. )?{name}\((?!\*args)(.*)\) -> ", documentation, re.M)
    for number, definition in enumerate(definitions):
        function = ast.parse(f"def f({signatures[min(number, len(signatures) - 1)]}): ...").body[0]
        is_alone = len(definitions) == 1
        assert arguments_of(definition, is_alone) == arguments_of(function, is_alone), name


def check_names(stub, module):
    definitions = {}
    for item in stub.body:
        name = item.target.id if isinstance(item, ast.AnnAssign) else getattr(item, "name", "_")
        definitions.setdefault(name, []).append(item)
    assert public(definitions) == public(vars(module)), module
    for name in public(definitions) | definitions.keys() & {"__init__"}:
        first, thing = definitions[name][0], getattr(module, name)
        if isinstance(first, ast.ClassDef):
            check_names(first, thing)
        elif isinstance(first, ast.FunctionDef) and callable(thing):
            check_function(name, definitions[name], thing)


def test_stub_and_module_have_the_same_names():
    check_names(ast.parse((FOLDER / "_morphray.pyi").read_text()), morphray._morphray)
    assert public(vars(morphray._morphray)) < set(morphray.__all__) <= public(vars(morphray))


@pytest.mark.skipif(not shutil.which("mypy"), reason="no mypy")
def test_mypy_finds_what_is_wrong_and_nothing_else(tmp_path):
    programs = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.S)
    programs.append((pathlib.Path(__file__).parent / "public_names.py").read_text())
    programs.append('import morphray\nmorphray.Scene([]).render(shading="pretty")\n')
    for number, program in enumerate(programs):
        (tmp_path / f"program{number}.py").write_text(program)
    done = subprocess.run(
        ["mypy", "--strict", "--follow-imports=silent", "--python-executable", sys.executable, "."],
        cwd=tmp_path, env={**os.environ, "MYPYPATH": str(FOLDER.parent)}, capture_output=True, text=True)
    lines = done.stdout.splitlines()
    assert len(lines) == 2 and f"program{len(programs) - 1}.py:2" in lines[0], done.stdout + done.stderr

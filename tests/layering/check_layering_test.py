"""check_layering_test.py: the checker rejects a planted violation of each of its rules. The test `layering` is of a sound
tree."""

import pathlib
import subprocess
import sys
import tempfile

CHECKER = pathlib.Path(__file__).with_name("check_layering.py")
SOUND = {"common/interop/a.h": '#include "common/interop/b.h"\n#include <cmath>\n',
         "app/cli/command_line.cpp": '#include <CLI/CLI.hpp>\n#include "app/base/a.h"\n',
         "cpu/packet/a.h": '#include "cpu/simd/a.h"\n'}
REMOVED = "Removed"  # keeps the names below from being taken for names in this file
PLANTED = [
    # The tables of rooms, of tests' rooms, of the program's folders, and of its engine.
    ("cpu/x.cpp", "<gpu/y.h>"),
    ("tests/common/x.cpp", '"app/y.h"'),
    ("app/base/x.h", '"app/cli/y.h"'),
    ("app/view/x.cpp", '"common/update/tree_updater.h"'),
    ("app/commands/x.cpp", '"library/src/scene_impl.h"'),
    # The orders of folders.
    ("cpu/simd/x.h", '"cpu/packet/a.h"'),
    ("scenes/obj/x.h", '"scenes/sequence/y.h"'),
    # Places of libraries, and paths.
    ("app/x.cpp", "<volk/volk.h>"),
    ("tests/x.cpp", "<stb/stb_image_write.h>"),
    ("common/x.cpp", '"../cpu/y.h"'),
    # Names in comments.
    ("common/x.h", f"<cmath> // as `common/{REMOVED}.h` has it"),
    ("common/x.h", f"<cmath> // a part of `k{REMOVED}`"),
    ("common/x.h", f"<cmath> // a part of `Frame::has{REMOVED}`"),
]


def verdict(files):
    with tempfile.TemporaryDirectory() as folder:
        for name, text in files.items():
            path = pathlib.Path(folder, name)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        return subprocess.run([sys.executable, CHECKER, folder], capture_output=True, text=True).stderr


assert verdict(SOUND) == ""
for file, include in PLANTED:
    said = verdict({**SOUND, file: f"// A comment.\n#include {include}\nint x;\n"})
    assert said.startswith("layering:\n") and said.count(file) == said.count("\n") - 1 == 1, (file, include, said)

"""check_names.py FILE: fails if two sources that are compiled as one give the same name to what has no
linkage, because a function of another file that fits a call better would take it without a word.

FILE has a line "TARGET<tab>SOURCE" for each source (cmake/precompile.cmake); sources of one folder in one
target are compiled together. Equal aliases are allowed. Relies on the layout of clang-format: what is in an
unnamed namespace begins in the first column.
"""

import collections
import pathlib
import re
import sys

PREFIX = r"^(?:\[\[\w+\]\] )?(?:(?:static|inline|constexpr|const|template <[^>]*>) )*"
KINDS = [
    ("type", re.compile(PREFIX + r"(?:struct|class|enum class|enum|union) (\w+)")),
    ("alias", re.compile(PREFIX + r"using (\w+) =")),
    ("alias", re.compile(r"^namespace (\w+) =")),
    ("function", re.compile(PREFIX + r"(?:[\w:<>,&*\[\]\s.]+?[ &*])(\w+)\(")),
    ("constant", re.compile(r"^[^(]*?\b(k[A-Z]\w*)\b")),
]


def names_in(text):
    """(name, kind, line) of what stands in unnamed namespaces."""
    is_inside = False
    for line in text.splitlines():
        if line.startswith("namespace {"):
            is_inside = True
        elif line == "}  // namespace":
            is_inside = False
        elif is_inside and (line[:1].isalpha() or line.startswith("[[")):
            if line.startswith(("TEST", "INSTANTIATE_")):
                continue
            for kind, pattern in KINDS:
                match = pattern.match(line)
                if match:
                    yield match.group(1), kind, line
                    break


def clashes(sources):
    """Descriptions of names that two of the sources (name -> text) share."""
    places = collections.defaultdict(dict)
    for source, text in sources.items():
        for name, kind, line in names_in(text):
            places[name].setdefault(source, (kind, line))
    for name, found in sorted(places.items()):
        is_same_alias = len(set(found.values())) == 1 and next(iter(found.values()))[0] == "alias"
        if len(found) > 1 and not is_same_alias:
            yield f"{name} is named in {', '.join(sorted(found))}"


def main():
    together = collections.defaultdict(dict)
    for line in pathlib.Path(sys.argv[1]).read_text().splitlines():
        if line:
            target, source = line.split("\t")
            path = pathlib.Path(source)
            together[target, path.parent][path.name] = path.read_text()
    count = 0
    for (target, folder), sources in sorted(together.items()):
        for clash in clashes(sources):
            print(f"{folder} ({target}): {clash}")
            count += 1
    if not together:
        print("no sources are named")
    sys.exit(1 if count or not together else 0)


if __name__ == "__main__":
    main()

"""The lists of mutations: reading them, and applying one to the text of its file.

A list is a text file of entries that are separated by empty lines:

    file tools/measure/median.h

    -     return values[middle];
    +     return values[middle + 1];

    equivalent: why no output can change
    -     if (a < b) {
          c = d;
    +     if (a <= b) {
          c = d;

`file` names the file of all entries that follow. An entry is the text before (lines with `-`) and
after (lines with `+`), of which lines with a space belong to both. The text before must occur exactly
once in the file. `equivalent:` says that no test can notice it, and why; `survives:` that one could,
and why none does; `test:`, before these, names a program and the test of it that is to notice the mutation.
`#` begins a comment.
"""

import dataclasses
import pathlib
from typing import Iterator


class BadList(Exception):
    """A list that cannot be read, or that no longer fits the sources."""


@dataclasses.dataclass
class Mutation:
    file: str
    before: str
    after: str
    equivalent: str
    survives: str
    test: str
    place: str  # list and line
    number: int = 0  # from 1, in all lists

    def apply(self, text: str) -> str:
        """Returns the text of the file with the mutation."""
        count = text.count(self.before)
        if count != 1:
            raise BadList(f"{self.place}: the text before occurs {count} times in {self.file}")
        return text.replace(self.before, self.after)

    def line(self, text: str) -> int:
        """Returns the number of the first line that differs."""
        same = 0
        for a, b in zip(self.before.split("\n"), self.after.split("\n")):
            if a != b:
                break
            same += 1
        return text[: text.index(self.before)].count("\n") + 1 + same

    def summary(self) -> str:
        """Returns the change in one line."""
        before, after = self.before.splitlines(), self.after.splitlines()
        gone = " ".join(line.strip() for line in before if line not in after)
        new = " ".join(line.strip() for line in after if line not in before)
        return f"{gone or '(nothing)'}  ->  {new or '(nothing)'}"


def entries(path: pathlib.Path) -> Iterator[tuple[int, list[str]]]:
    """Yields the number of the first line and the lines of each entry."""
    lines: list[str] = []
    number = 0
    for number, line in enumerate(path.read_text().splitlines() + [""], 1):
        if line.startswith("#"):
            continue
        if line:
            lines.append(line)
        elif lines:
            yield number - len(lines), lines
            lines = []


def read_list(path: pathlib.Path) -> list[Mutation]:
    """Returns the mutations of a list."""
    mutations = []
    file = ""
    for number, lines in entries(path):
        place = f"{path.name}:{number}"
        if lines[0].startswith("file "):
            file = lines.pop(0).removeprefix("file ")
        notes = {"test": "", "equivalent": "", "survives": ""}
        for kind in notes:
            if lines and lines[0].startswith(f"{kind}: "):
                notes[kind] = lines.pop(0).removeprefix(f"{kind}: ")
        if not lines:
            continue
        if any(line[0] not in " -+" for line in lines) or not file:
            raise BadList(f"{place}: not an entry of a list of mutations")
        before = "\n".join(line[1:] for line in lines if line[0] in " -") + "\n"
        after = "".join(line[1:] + "\n" for line in lines if line[0] in " +")
        if before == after:
            raise BadList(f"{place}: changes nothing")
        mutations.append(Mutation(file, before, after, notes["equivalent"], notes["survives"],
                                  notes["test"], place))
    return mutations


def read_lists(folder: pathlib.Path) -> list[Mutation]:
    """Returns the mutations of all lists of a folder."""
    mutations = [m for path in sorted(folder.glob("*.txt")) for m in read_list(path)]
    for number, mutation in enumerate(mutations, 1):
        mutation.number = number
    return mutations


def check(mutations: list[Mutation], root: pathlib.Path) -> list[str]:
    """Returns a line for each mutation that does not fit the sources, or that is listed twice."""
    complaints = []
    seen: dict[tuple[str, str, str], str] = {}
    for m in mutations:
        key = (m.file, m.before, m.after)
        if key in seen:
            complaints.append(f"{m.place}: is {seen[key]} again")
        seen[key] = m.place
        path = root / m.file
        if not path.is_file():
            complaints.append(f"{m.place}: no file {m.file}")
            continue
        try:
            m.apply(path.read_text())
        except BadList as error:
            complaints.append(str(error))
    return complaints

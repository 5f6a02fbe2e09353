"""Many mutations in one build, of which the environment chooses one when a program starts.

Based on: R. Untch, A. Offutt, M. Harrold. Mutation analysis using mutant schemata. ISSTA 1993. What
differs here: it works on lines of text, and a mutation that cannot be chosen at run time (a constant
of the compiler, a declaration, a shader) is left to a build of its own.
"""

import re

from mutation_list import Mutation

HEADER = "mutant.h"
HEADER_TEXT = """// Which mutation is chosen: MORPHRAY_MUTANT, 0 for none.
#pragma once
#include <cstdlib>
inline int mutant_of_environment() {
    const char* const text = std::getenv("MORPHRAY_MUTANT");
    return text == nullptr ? 0 : std::atoi(text);
}
inline const int mutant_chosen = mutant_of_environment();
#define MUTANT(number) (mutant_chosen == (number))
"""

DECLARATION = re.compile(
    r"^\s*(const|constexpr|static|auto|inline|template|using|HWY_|SHARED|struct|class)\b"
    r"|^\s*(?!return\b|else\b|throw\b|delete\b)[\w:]+(<.*>)?[&\*]? [&\*]?\w+( = |\(|;|\[|\{|, )")
ASSIGNMENT = re.compile(r" ([-+*/%&|^]|<<|>>)?= $")
OPEN, CLOSE = "([{", ")]}"


def _left(text: str, at: int) -> int:
    """Returns where the expression begins that holds the place; -1 if the line does not say."""
    depth = 0
    while at > 0:
        before = text[:at]
        if text[at - 1] in CLOSE:
            depth += 1
        elif text[at - 1] in OPEN:
            if depth == 0:
                return at
            depth -= 1
        elif depth == 0:
            if text[at - 1] in ",;" or ASSIGNMENT.search(before):
                return at
            if before.endswith((" ? ", " : ")) or re.search(r"\breturn $", before):
                return at
        at -= 1
    return -1


def _right(text: str, at: int) -> int:
    """Returns where the expression ends that holds the place; -1 if the line does not say, or if
    something is assigned to it."""
    depth = 0
    while at < len(text):
        if text[at] in OPEN:
            depth += 1
        elif text[at] in CLOSE:
            if depth == 0:
                return at
            depth -= 1
        elif depth == 0:
            if text[at] in ",;" or text[at:].startswith((" ? ", " : ")):
                return at
            if re.match(r" ([-+*/%&|^]|<<|>>)?= ", text[at:]):
                return -1
        at += 1
    return -1


def _balanced(text: str) -> bool:
    depth = 0
    for c in text:
        depth += (c in OPEN) - (c in CLOSE)
        if depth < 0:
            return False
    return depth == 0 and text.strip() != ""


def _is_statement(lines: list[str], before: str) -> bool:
    """Whether lines are one statement that is no declaration; before: the line above."""
    text = "\n".join(lines)
    starts = before == "" or before.rstrip()[-1:] in (";", "{", "}", ":", ")") or \
        before.strip() in ("else", "do")
    return (starts and text.endswith(";") and _balanced(text)
            and not DECLARATION.match(lines[0])
            and not re.match(r"\s*(for|while|case|default|break|return|HWY_)\b", lines[0]))


def _choice(old: str, new: str, number: int) -> str | None:
    """Returns a line that has the old or the new expression."""
    if re.match(r"\s*(//|#)", old) or "//" in old:
        return None
    first = 0
    while first < min(len(old), len(new)) and old[first] == new[first]:
        first += 1
    last = 0
    while last < min(len(old), len(new)) - first and old[-1 - last] == new[-1 - last]:
        last += 1
    # A name that begins or ends within the change belongs to it.
    while first > 0 and re.match(r"[\w.]", old[first - 1]):
        first -= 1
    while last > 0 and re.match(r"[\w.]", old[len(old) - last]):
        last -= 1
    left = _left(old, first)
    old_right, new_right = _right(old, len(old) - last), _right(new, len(new) - last)
    if left < 0 or old_right < 0 or new_right < 0:
        return None
    a, b = old[left:old_right], new[left:new_right]
    if not _balanced(a) or not _balanced(b):
        return None
    space = a[: len(a) - len(a.lstrip())]
    a, b = a.strip(), b.strip()
    if a in (f"!{b}", f"!({b})") or b in (f"!{a}", f"!({a})"):
        # An optional or a pointer and a bool have no type in common that means the same.
        a, b = f"static_cast<bool>({a})", f"static_cast<bool>({b})"
    return f"{old[:left]}{space}(MUTANT({number}) ? ({b}) : ({a})){old[old_right:]}"


def _entry(mutation: Mutation) -> tuple[list[str], list[str], list[str]]:
    """Returns the lines before the change, the old lines and the new lines."""
    old, new = mutation.before.splitlines(), mutation.after.splitlines()
    same = 0
    while same < min(len(old), len(new)) and old[same] == new[same]:
        same += 1
    tail = 0
    while tail < min(len(old), len(new)) - same and old[-1 - tail] == new[-1 - tail]:
        tail += 1
    return old[:same], old[same:len(old) - tail], new[same:len(new) - tail]


def insert(text: list[str], mutation: Mutation, source: str, number: int) -> bool:
    """Inserts a mutation as a choice into the lines of a file, of which `source` is the text without
    any. Returns whether that can be done; otherwise the lines stay as they are. Lines keep their
    numbers."""
    if mutation.file.endswith((".comp", ".glsl")) or mutation.file.startswith("common/interop/"):
        return False
    _, old, new = _entry(mutation)
    at = mutation.line(source) - 1
    if text[at:at + len(old)] != old:
        return False  # another mutation is there
    above = next((line for line in reversed(text[:at]) if line.strip()), "")
    if len(old) == len(new) == 1:
        line = _choice(old[0], new[0], number)
        if line is not None:
            text[at] = line
            return True
    if not old or not _is_statement(old, above):
        return False
    if new and not (_is_statement(new, above) and len(new) == len(old) == 1):
        return False
    if new:
        text[at] = f"{{ if (MUTANT({number})) {{ {new[0].strip()} }} else {{ {old[0].strip()} }} }}"
    else:
        text[at] = f"{{ if (!MUTANT({number})) {{ {old[0].strip()}"
        text[at + len(old) - 1] += " } }"
    return True


ERROR = re.compile(r"^(?:In file included from )?(\S+?):(\d+):\d+: (?:fatal )?error:", re.M)


class Merged:
    """Files with many mutations each, by numbers above 0."""

    def __init__(self, mutations: dict[int, Mutation], sources: dict[str, str]):
        self.sources = sources
        self.mutations = mutations
        self.numbers = list(self.mutations)
        self.places: dict[tuple[str, int], int] = {}
        self.texts: dict[str, str] = {}
        self._merge()

    def _merge(self) -> None:
        """Inserts the mutations of self.numbers, and leaves there those that can be inserted."""
        lines = {file: text.splitlines() for file, text in self.sources.items()}
        inserted = []
        self.places = {}
        for number in self.numbers:
            m = self.mutations[number]
            if insert(lines[m.file], m, self.sources[m.file], number):
                inserted.append(number)
                # The first line of the file includes the header.
                first = m.line(self.sources[m.file]) + 1
                for line in range(first, first + m.before.count("\n")):
                    self.places.setdefault((m.file, line), number)
        self.numbers = inserted
        self.texts = {
            file: f'#include "{HEADER}"\n' + "\n".join(lines[file]) + "\n"
            for file in {self.mutations[number].file for number in inserted}}

    def leave_out(self, messages: str, folder: str) -> bool:
        """Leaves out the mutations that a compiler complains of, whose messages name files below the
        folder. Returns whether there are any."""
        bad = set()
        for path, line in ERROR.findall(messages):
            file = path.partition(folder + "/")[2] or path.removeprefix("../source/")
            bad.add(self.places.get((file, int(line)), 0))
        bad.discard(0)
        self.numbers = [number for number in self.numbers if number not in bad]
        self._merge()
        return bool(bad)

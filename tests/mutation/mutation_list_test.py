"""The reader of lists of mutations."""

import pathlib
import tempfile
import unittest

import mutation_list

LIST = """# A comment.
file a.cpp

-    x = 1;
+    x = 2;

test: a_test A.B
equivalent: nothing reads y
     if (x)
-        y = 3;
"""
SOURCE = "    x = 1;\n    if (x)\n        y = 3;\n    y = 3;\n"


class MutationList(unittest.TestCase):
    def setUp(self) -> None:
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.root = pathlib.Path(self.folder.name)

    def read(self, text: str) -> list[mutation_list.Mutation]:
        path = self.root / "list.txt"
        path.write_text(text)
        return mutation_list.read_list(path)

    def complaints(self, source: str, text: str = LIST) -> list[str]:
        (self.root / "a.cpp").write_text(source)
        return mutation_list.check(self.read(text), self.root)

    def test_replaces_and_removes_lines(self) -> None:
        first, second = self.read(LIST)
        self.assertEqual(first.apply(SOURCE), SOURCE.replace("1", "2"))
        self.assertEqual(first.equivalent, "")
        self.assertEqual(second.apply(SOURCE), "    x = 1;\n    if (x)\n    y = 3;\n")
        self.assertEqual(second.equivalent, "nothing reads y")
        self.assertEqual((first.test, second.test), ("", "a_test A.B"))
        self.assertEqual(second.line(SOURCE), 3)

    def test_complains_of_text_that_is_not_there_exactly_once(self) -> None:
        self.assertEqual(self.complaints(SOURCE), [])
        self.assertEqual(len(self.complaints(SOURCE.replace("x = 1", "x = 7"))), 1)
        self.assertEqual(len(self.complaints(SOURCE + SOURCE)), 2)

    def test_complains_of_what_is_listed_twice_and_of_files_that_are_gone(self) -> None:
        self.assertEqual(len(self.complaints(SOURCE, LIST + "\n-    x = 1;\n+    x = 2;\n")), 1)
        self.assertEqual(len(self.complaints(SOURCE, LIST.replace("a.cpp", "b.cpp"))), 2)

    def test_refuses_what_is_no_entry(self) -> None:
        for text in ("-    x = 1;\n", "file a.cpp\n\nx = 1;\n", "file a.cpp\n\n-x\n+x\n"):
            with self.assertRaises(mutation_list.BadList):
                self.read(text)


if __name__ == "__main__":
    unittest.main()

"""The check of names finds what it should."""

import unittest

import check_names

FAIL = "[[noreturn]] void fail(const std::string& what) {\n    throw what;\n}\n"
PATH_FAIL = "[[noreturn]] void fail(const fs::path& path,\n                       int code) {\n}\n"


def source(body):
    return f"namespace mray {{\nnamespace {{\n\n{body}\n}}  // namespace\n\nvoid fail(int) {{}}\n}}  // namespace mray\n"


class CheckNames(unittest.TestCase):
    def names(self, first, second):
        return [clash.split()[0] for clash in check_names.clashes({"a": source(first), "b": source(second)})]

    def test_functions_that_overload_each_other_clash(self):
        self.assertEqual(self.names(FAIL, PATH_FAIL), ["fail"])

    def test_constants_and_types_clash(self):
        self.assertEqual(self.names("constexpr double kSize = 2;\n", "const int kSize[] = {1};\n"), ["kSize"])
        self.assertEqual(self.names("struct Row {\n    int x;\n};\n", "class Row final {\n};\n"), ["Row"])
        self.assertEqual(self.names("struct Row {\n};\n", "using Row = int;\n"), ["Row"])

    def test_templates_and_references_are_seen(self):
        first = "template <class T>\nconst T& best(const T& a) {\n    return a;\n}\n"
        self.assertEqual(self.names(first, "std::vector<int>* best(int a) {\n}\n"), ["best"])

    def test_equal_aliases_and_other_names_pass(self):
        self.assertEqual(self.names("using Json = nlohmann::json;\n", "using Json = nlohmann::json;\n"), [])
        self.assertEqual(self.names("using Json = nlohmann::json;\n", "using Json = int;\n"), ["Json"])
        self.assertEqual(self.names(FAIL, "int other(int fail) {\n    return fail(2);\n}\n"), [])
        self.assertEqual(self.names(FAIL, ""), [])


if __name__ == "__main__":
    unittest.main()

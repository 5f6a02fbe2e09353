# A help text of the program to lines of six fields, with tabs between them:
#
#   kind  command  name  value  required  text
#
# kind is about, usage, command, positional, option or note; command is empty for the help of the
# program itself; required is 0 or 1.
BEGIN { FS = "\n"; OFS = "\t"; column = 30 }

function emit(kind, name, value, required, text) { print kind, command, name, value, required, text }

# The entry that was read: its left column, and the text beside or below it.
function finish(    space, name, value, required) {
    if (left == "") return
    sub(/ +$/, "", left)
    required = sub(/ REQUIRED$/, "", left)
    space = index(left, " ")
    name = space ? substr(left, 1, space - 1) : left
    value = space ? substr(left, space + 1) : ""
    emit(section, name, value, required, text)
    left = text = ""
}

/^Usage: / { emit("usage", "", "", 0, substr($0, 8)); next }
/^Options:$/ { finish(); section = "option"; next }
/^Positionals:$/ { finish(); section = "positional"; next }
/^Subcommands:$/ { finish(); section = "command"; next }
/^$/ { finish(); section = ""; next }
section != "" && /^  [^ ]/ {
    finish()
    entry = substr($0, 3)
    # A left column that is too wide has its text on the next line.
    if (length($0) > column && substr($0, column, 1) == " ") {
        left = substr($0, 3, column - 2)
        text = substr($0, column + 1)
    } else {
        left = entry
    }
    next
}
section != "" && /^ / { sub(/^ +/, ""); text = text (text == "" ? "" : " ") $0; next }
{ emit(seen++ ? "note" : "about", "", "", 0, $0) }
END { finish() }

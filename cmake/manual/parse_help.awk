# A help text of the program to lines of six fields, with tabs between them:
#
#   kind  command  name  value  required  text
#
# kind is about, usage, command, positional, option, example or note; command is empty for the help
# of the program itself; required is 0 or 1. A positional has no name; the name of an example is what
# it does, its text the line. app/cli/help/help_formatter.h says how the help is written.
BEGIN { FS = "\n"; OFS = "\t"; column = 30; paragraph = "about" }

function emit(kind, name, value, required, text) { print kind, command, name, value, required, text }

# The entry or paragraph that was read: its left column, and the text beside or below it.
function finish(    space, name, value, required) {
    if (section == "" || section == "example") {
        if (text != "") emit(paragraph, "", "", 0, text)
        text = ""
        return
    }
    if (left == "") return
    sub(/ +$/, "", left)
    required = sub(/ REQUIRED$/, "", left)
    space = index(left, " ")
    name = space ? substr(left, 1, space - 1) : left
    value = space ? substr(left, space + 1) : ""
    if (section == "positional") {
        name = ""
        value = left
        required = value !~ /^\[/
        gsub(/[][]/, "", value)
    }
    emit(section, name, value, required, text)
    left = text = ""
}

function begin(kind) {
    finish()
    section = kind
    paragraph = "note"
}

/^Usage: / { begin(""); emit("usage", "", "", 0, substr($0, 8)); next }
/^Options:$/ { begin("option"); next }
/^Arguments:$/ { begin("positional"); next }
/^Commands:$/ { begin("command"); next }
/^Examples:$/ { begin("example"); does = ""; next }
/^$/ { begin(""); next }
section == "example" && /^    / { emit("example", substr(does, 1, length(does) - 1), "", 0, substr($0, 5)); does = ""; next }
section == "example" { sub(/^ +/, ""); does = does (does == "" ? "" : " ") $0; next }
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
{ sub(/^ +/, ""); text = text (text == "" ? "" : " ") $0 }
END { begin("") }

# man_page.awk -v command=COMMAND -v version=VERSION: the man page of a command, or of the program.
BEGIN { FS = "\t" }

# As it is typed: with hyphens that are minus signs.
function code(text) {
    gsub(/\\/, "\\e", text)
    gsub(/-/, "\\-", text)
    return text
}

# A sentence: what stands in backticks is bold.
function prose(text,    parts, n, i, result) {
    n = split(text, parts, "`")
    for (i = 1; i <= n; ++i) {
        result = result (i % 2 ? code(parts[i]) : "\\fB" code(parts[i]) "\\fP")
    }
    if (result ~ /^[.']/) result = "\\&" result
    return result
}

# Words of a list are typed as they are; a value is a placeholder.
function value_text(value,    parts, n, i, result) {
    if (value == "") return ""
    if (value !~ /\|/ || value ~ /^[A-Z]/) return " \\fI" code(value) "\\fP"
    n = split(value, parts, "|")
    for (i = 1; i <= n; ++i) result = result (i > 1 ? "|" : "") "\\fB" code(parts[i]) "\\fP"
    return " " result
}

function entry(name, value, required, text,    parts, n, i, line) {
    n = split(name, parts, ",")
    for (i = 1; i <= n; ++i) line = line (i > 1 ? ", " : "") "\\fB" code(parts[i]) "\\fP"
    line = line value_text(value)
    sub(/^ /, "", line)
    return ".TP\n" line "\n" prose(text) (required ? " (required)" : "") "\n"
}

function exit_codes(text,    parts, n, i, result) {
    sub(/^Exit codes: /, "", text)
    sub(/\.$/, "", text)
    n = split(text, parts, ", ")
    for (i = 1; i <= n; ++i) {
        match(parts[i], /^[0-9]+( and [0-9]+)?/)
        result = result ".TP\n\\fB" substr(parts[i], 1, RLENGTH) "\\fP\n" substr(parts[i], RLENGTH + 2) "\n"
    }
    return result
}

$2 != command { next }
$1 == "about" { about = $6 }
$1 == "usage" { usage = $6 }
$1 == "command" {
    commands = commands ".TP\n\\fB" $3 "\\fP\n" prose($6) ". See \\fBmorphray\\-" $3 "\\fP(1).\n"
    also = also (also == "" ? "" : ",\n") ".BR morphray\\-" $3 " (1)"
}
$1 == "positional" { positionals = positionals entry("", $4, $5, $6) }
# The lines of an example after the first have no name.
$1 == "example" && $3 != "" { examples = examples ".PP\n" prose($3) ":\n" }
$1 == "example" { examples = examples ".PP\n.nf\n.RS\n" code($6) "\n.RE\n.fi\n" }
$1 == "option" { options = options entry($3, $4, $5, $6) }
$1 == "note" && $6 ~ /^Exit codes: / { codes = exit_codes($6); next }
$1 == "note" { notes = notes ".PP\n" prose($6) "\n" }

END {
    page = "morphray" (command == "" ? "" : "-" command)
    short = about
    sub(/\.$/, "", short)
    printf ".TH %s 1 \"\" \"morphray %s\" \"User Commands\"\n", toupper(page), version
    printf ".SH NAME\n%s \\- %s\n", code(page), prose(tolower(substr(short, 1, 1)) substr(short, 2))
    printf ".SH SYNOPSIS\n\\fB%s\\fP\n", code(usage)
    if (commands != "") printf ".SH COMMANDS\n%s", commands
    if (positionals != "") printf ".SH ARGUMENTS\n%s", positionals
    printf ".SH OPTIONS\n%s", options
    sub(/^\.PP\n/, "", examples)
    if (examples != "") printf ".SH EXAMPLES\n%s", examples
    sub(/^\.PP\n/, "", notes)
    if (notes != "") printf ".SH NOTES\n%s", notes
    printf ".SH EXIT STATUS\n%s", codes
    printf ".SH SEE ALSO\n%s\n", also == "" ? ".BR morphray (1)" : also
}

# The part that the completions of all shells share: what an option takes.
BEGIN { FS = "\t" }

# "list", "several" (of a list, with commas between them), "file", "folder", "scene", "none" (a flag) or "any" (nothing to offer).
function takes(value) {
    if (value == "") return "none"
    if (value ~ /^[a-z0-9]+(\|[a-z0-9]+(:K)?)+$/) return "list"
    if (value ~ /^[a-z0-9]+(\|[a-z0-9]+(:K)?)+,\.\.\.$/) return "several"
    if (value ~ /^FILE/) return "file"
    if (value ~ /^DIR/) return "folder"
    if (value ~ /^SCENE/) return "scene"
    return "any"
}

# The words of a list, with blanks between them.
function words(value) {
    gsub(/:K/, ":", value)
    sub(/,\.\.\.$/, "", value)
    gsub(/\|/, " ", value)
    return value
}

# The text in single quotes of a shell; the quotes in it as `escaped`.
function quoted(text, escaped) {
    gsub(/'/, escaped, text)
    return "'" text "'"
}

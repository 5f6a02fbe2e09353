# Completion for zsh.
function bracketed(text) {
    gsub(/\\/, "\\\\", text)
    gsub(/\[/, "\\[", text)
    gsub(/\]/, "\\]", text)
    return "[" text "]"
}

# Returns the text that follows the name of an option.
function argument(value,    kind, name) {
    kind = takes(value)
    name = tolower(value)
    gsub(/[^a-z]+/, " ", name)
    if (kind == "none") return ""
    if (kind == "list") {
        value = words(value)
        gsub(/:/, "\\:", value)
        return ":value:(" value ")"
    }
    if (kind == "several") {
        value = words(value)
        gsub(/:/, "\\\\:", value)
        return ":values:_values -s , value " value
    }
    if (kind == "file") return ":file:_files"
    if (kind == "folder") return ":folder:_files -/"
    return ":" name ":"
}

function specification(names, value, text,    parts, n, rest) {
    n = split(names, parts, ",")
    rest = (value == "" ? "" : "=") bracketed(text) argument(value)
    if (n == 1) return quoted(names rest, "'\\''")
    return "'(" parts[1] " " parts[2] ")'{" parts[1] "," parts[2] "}" quoted(rest, "'\\''")
}

$1 == "scene" {
    name = $3
    gsub(/:/, "\\:", name)
    scenes = scenes " '" name "'"
}
$1 == "command" { names_of[++count] = $3; commands = commands "        " quoted($3 ":" $6, "'\\''") "\n" }
$1 == "option" { options[$2] = options[$2] " \\\n            " specification($3, $4, $6) }
$1 == "positional" { options[$2] = options[$2] " \\\n            '" ($4 ~ /\.\.\./ ? "*" : "1") (takes($4) == "folder" ? ":folder:_files -/'" : takes($4) == "file" ? ":file:_files'" : ":scene:_morphray_scenes'") }
END {
    print "#compdef morphray"
    print "# zsh completion for morphray, written from its help."
    print ""
    print "_morphray_scenes() {"
    print "    local -a scenes=(" substr(scenes, 2) ")"
    print "    local found=1"
    print "    _describe -t builtin 'built-in scene' scenes && found=0"
    print "    _files -g '*.(obj|ply|gltf|glb)' && found=0"
    print "    return found"
    print "}"
    print ""
    print "_morphray() {"
    print "    local curcontext=$curcontext state line"
    print "    typeset -A opt_args"
    print "    local -a commands=("
    printf "%s", commands
    print "        'help:The options of a command'"
    print "    )"
    print "    _arguments -C" options[""] " \\"
    print "            '1:command:->command' '*::argument:->argument' && return"
    print "    if [[ $state == command ]]; then"
    print "        _describe -t commands command commands"
    print "        return"
    print "    fi"
    print "    case $line[1] in"
    print "        help) _describe -t commands command commands ;;"
    for (i = 1; i <= count; ++i) {
        command = names_of[i]
        print "        " command ") _arguments" options[command] " ;;"
    }
    print "    esac"
    print "}"
    print ""
    print "_morphray \"$@\""
}

# Completion for fish.
function text_of(text) {
    gsub(/\\/, "\\\\", text)
    return quoted(text, "\\'")
}

BEGIN {
    print "# fish completion for morphray, written from its help."
    print "complete -c morphray -f"
    print "complete -c morphray -n __fish_use_subcommand -a help -d 'The options of a command'"
}
$1 == "command" {
    print "complete -c morphray -n __fish_use_subcommand -a " $3 " -d " text_of($6)
    print "complete -c morphray -n '__fish_seen_subcommand_from help' -a " $3 " -d " text_of($6)
}
$1 == "scene" { scenes = scenes (scenes == "" ? "" : " ") $3 }
$1 == "positional" && takes($4) == "scene" { takes_scene = takes_scene " " $2 }
$1 == "positional" && takes($4) == "folder" { print "complete -c morphray -n '__fish_seen_subcommand_from " $2 "' -a '(__fish_complete_directories)'" }
$1 == "positional" && takes($4) == "file" { print "complete -c morphray -n '__fish_seen_subcommand_from " $2 "' -F" }
$1 == "option" {
    line = "complete -c morphray -n " ($2 == "" ? "__fish_use_subcommand" : "'__fish_seen_subcommand_from " $2 "'")
    n = split($3, names, ",")
    for (i = 1; i <= n; ++i)
        line = line (names[i] ~ /^--/ ? " -l " substr(names[i], 3) : " -s " substr(names[i], 2))
    kind = takes($4)
    if (kind == "list" || kind == "several") line = line " -x -a '" words($4) "'"
    else if (kind == "file") line = line " -r -F"
    else if (kind == "folder") line = line " -x -a '(__fish_complete_directories)'"
    else if (kind == "any") line = line " -x"
    print line " -d " text_of($6)
}
END {
    condition = "'__fish_seen_subcommand_from" takes_scene "'"
    print "complete -c morphray -n " condition " -a '" scenes "'"
    print "complete -c morphray -n " condition " -a '(__fish_complete_suffix .obj)'"
    print "complete -c morphray -n " condition " -a '(__fish_complete_suffix .ply)'"
    print "complete -c morphray -n " condition " -a '(__fish_complete_suffix .gltf)'"
    print "complete -c morphray -n " condition " -a '(__fish_complete_suffix .glb)'"
}

# Completion for bash (4.3 or later), with or without the package bash-completion.
$1 == "command" { names_of[++count] = $3; commands = commands " " $3 }
$1 == "scene" { scenes = scenes (scenes == "" ? "" : " ") $3 }
$1 == "positional" && takes($4) == "scene" { takes_scene = takes_scene (takes_scene == "" ? "" : " | ") $2 }
$1 == "positional" && takes($4) == "file" { takes_file = takes_file (takes_file == "" ? "" : " | ") $2 }
$1 == "option" {
    names = $3
    gsub(/,/, " ", names)
    options[$2] = options[$2] (options[$2] == "" ? "" : " ") names
    kind = takes($4)
    if (kind == "none") next
    if (kind == "list") act = "_morphray_offer '" words($4) "'"
    else if (kind == "several") act = "_morphray_offer_several '" words($4) "'"
    else if (kind == "file") act = "_morphray_files -f"
    else if (kind == "folder") act = "_morphray_files -d"
    else act = ":"
    n_names = split(names, each, " ")
    for (i = 1; i <= n_names; ++i) acts[act] = acts[act] (acts[act] == "" ? "" : " | ") $2 "," each[i]
    if (!(act in order)) { order[act] = ++n; act_of[n] = act }
}
END {
    print "# bash completion for morphray, written from its help."
    print ""
    print "_morphray_offer() { mapfile -t COMPREPLY < <(compgen -W \"$1\" -- \"$cur\"); }"
    print ""
    print "# The last of several, with commas between them."
    print "_morphray_offer_several() {"
    print "    local before=${cur%\"${cur##*,}\"}"
    print "    mapfile -t COMPREPLY < <(compgen -P \"$before\" -W \"$1\" -- \"${cur##*,}\")"
    print "}"
    print ""
    print "_morphray_files() {"
    print "    mapfile -t -O ${#COMPREPLY[@]} COMPREPLY < <(compgen \"$@\" -- \"$cur\")"
    print "    compopt -o filenames 2>/dev/null || true"
    print "}"
    print ""
    print "_morphray_scenes() {"
    print "    _morphray_offer '" scenes "'"
    print "    [[ -n $cur && ${#COMPREPLY[@]} -gt 0 ]] || {"
    print "        _morphray_files -d"
    print "        _morphray_files -f -X '!*.obj'"
    print "        _morphray_files -f -X '!*.ply'"
    print "        _morphray_files -f -X '!*.gltf'"
    print "        _morphray_files -f -X '!*.glb'"
    print "    }"
    print "}"
    print ""
    print "_morphray() {"
    print "    local cur option command= typed head word i words=()"
    print "    # What bash cut at a colon or an equals sign is one word again."
    print "    for ((i = 0; i <= COMP_CWORD; ++i)); do"
    print "        word=${COMP_WORDS[i]}"
    print "        if ((i > 0)) && [[ $word == [:=]* || ${words[-1]} == *[:=] ]]; then"
    print "            words[-1]+=$word"
    print "        else"
    print "            words+=(\"$word\")"
    print "        fi"
    print "    done"
    print "    typed=${words[-1]} cur=$typed option=${words[-2]}"
    print "    for word in \"${words[@]:1:${#words[@]}-2}\"; do"
    print "        [[ $word == -* ]] || { command=$word; break; }"
    print "    done"
    print "    if [[ $cur == --*=* ]]; then"
    print "        option=${cur%%=*} cur=${cur#*=}"
    print "    fi"
    print "    COMPREPLY=()"
    print "    case $command,$option in"
    for (i = 1; i <= n; ++i) print "        " acts[act_of[i]] ") " act_of[i] " ;;"
    print "        ,*) _morphray_offer 'help" commands " " options[""] "' ;;"
    print "        help,*) _morphray_offer '" substr(commands, 2) "' ;;"
    print "        *)"
    print "            if [[ $cur == -* ]]; then"
    print "                case $command in"
    for (i = 1; i <= count; ++i) {
        command = names_of[i]
        print "                    " command ") _morphray_offer '" options[command] "' ;;"
    }
    print "                esac"
    print "            else"
    print "                case $command in " takes_scene ") _morphray_scenes ;; " takes_file ") _morphray_files -f ;; esac"
    print "            fi"
    print "            ;;"
    print "    esac"
    print "    # bash replaces only what follows the last colon or equals sign."
    print "    word=${COMP_WORDS[COMP_CWORD]}"
    print "    head=$typed"
    print "    [[ $word == [:=]* ]] || head=${typed%\"$word\"}"
    print "    for i in \"${!COMPREPLY[@]}\"; do"
    print "        word=${typed%\"$cur\"}${COMPREPLY[i]}"
    print "        COMPREPLY[i]=${word#\"$head\"}"
    print "    done"
    print "}"
    print ""
    print "complete -F _morphray morphray"
}

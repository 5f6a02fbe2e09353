# Functions that the scripts share: install what is missing, configure, build. To be sourced by
# bash with `root` set to the checkout; a first argument --no-install is taken from the script's
# arguments. Exit codes (docs/guide/options.md): 4 when packages cannot be had, 70 for a failed build.
: "${root:?}"
build_targets=()
install=yes
if [ "${1:-}" = --no-install ]; then
    install=no
    shift
fi

# use_preset NAME: what set_up configures and builds.
use_preset() {
    preset=$1
    build=$root/build/$preset
    log=$build/setup.log
}
use_preset release

say() { printf 'morphray: %s\n' "$*" >&2; }

# packages KIND...: the names listed under these kinds.
packages() {
    local kind names wanted=" $* "
    while read -r kind names; do
        # shellcheck disable=SC2086  # names are words
        case $wanted in *" $kind "*) printf '%s\n' $names ;; esac
    done <"$root/cmake/packages.txt"
}

# missing_packages KIND...: those that are not installed, by asking dpkg alone.
missing_packages() {
    local name installed
    # shellcheck disable=SC2016  # dpkg-query expands these
    installed=$(packages "$@" |
        xargs dpkg-query -W -f '${Package} ${db:Status-Status}\n' 2>/dev/null) || true
    for name in $(packages "$@"); do
        grep -qxF "$name installed" <<<"$installed" || printf '%s\n' "$name"
    done
}

show_log_and_exit() { # CODE MESSAGE
    cat "$log" >&2
    say "$2"
    exit "$1"
}

# install_missing KIND...: where `install` is "no" it only says what to type. The build folder's cache
# may lack what was installed, so `configure` has to look again.
install_missing() {
    local missing prefix=()
    if ! command -v dpkg-query >/dev/null; then
        # What else is missing is named by cmake/dependencies.cmake.
        { command -v cmake && command -v ninja; } >/dev/null ||
            { say "CMake 3.25 and Ninja 1.11 are needed"; exit 4; }
        return
    fi
    mapfile -t missing < <(missing_packages "$@")
    [ ${#missing[@]} -gt 0 ] || return 0
    [ "$(id -u)" = 0 ] || prefix=(sudo)
    local line="${prefix[*]:+${prefix[*]} }apt-get install --no-install-recommends ${missing[*]}"
    if [ "$install" = no ]; then
        printf '%s\n' "$line"
        exit 4
    fi
    say "installing ${missing[*]}"
    local apt=("${prefix[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -y)
    # A list that is stale or cannot be refreshed shows when the packages are fetched.
    "${apt[@]}" update </dev/null >>"$log" 2>&1 || true
    "${apt[@]}" install --no-install-recommends "${missing[@]}" </dev/null >>"$log" 2>&1 ||
        show_log_and_exit 4 "packages could not be installed; try: $line"
    rm -f "$build/build.ninja"
}

# apt_with_state STATE ARCHITECTURE ARGUMENT...: apt with the folder STATE, in which nothing is installed.
apt_with_state() {
    local state=$1 architecture=$2
    shift 2
    mkdir -p "$state/lists/partial" "$state/archives/partial"
    : >"$state/status"
    cat >"$state/apt.conf" <<END
APT::Architecture "$architecture";
APT::Architectures { "$architecture"; };
APT::Install-Recommends "false";
APT::Sandbox::User "";
Debug::NoLocking "true";
Dir::State "$state";
Dir::State::status "$state/status";
Dir::Cache "$state";
END
    APT_CONFIG=$state/apt.conf apt-get -q -y "$@" >>"$log" 2>&1
}

cache_has() { grep -qxF "$1" "$build/CMakeCache.txt" 2>/dev/null; }

# configure TESTS: once; afterwards ninja does it. Without tests (OFF) a tree that has them will do.
configure() {
    local tests=$1 minutes=3
    # A checkout that was moved or copied with its build folder.
    cache_has "CMAKE_HOME_DIRECTORY:INTERNAL=$root" ||
        rm -rf "$build/CMakeCache.txt" "$build/CMakeFiles" "$build/build.ninja"
    if [ -e "$build/build.ninja" ] &&
        { [ "$tests" = OFF ] || cache_has MORPHRAY_TESTS:BOOL=ON; }; then
        return
    fi
    cache_has MORPHRAY_TESTS:BOOL=ON && tests=ON
    [ "$tests" = OFF ] || minutes=8
    say "building; the first time takes about $minutes minutes on two cores"
    (cd "$root" && cmake --preset "$preset" -DMORPHRAY_TESTS="$tests") </dev/null >>"$log" 2>&1 ||
        show_log_and_exit "$(grep -q "libraries are missing" "$log" && echo 4 || echo 70)" "configuring failed"
}

# set_up TESTS KIND...: everything up to a program that is up to date, one call at a time. Builds the
# array build_targets; if that is empty, all with tests, and the program without.
set_up() {
    local tests=$1 targets=("${build_targets[@]}")
    shift
    [ "$tests" = ON ] || [ ${#targets[@]} -gt 0 ] || targets=(morphray)
    if ! mkdir -p "$build"; then
        say "$build cannot be made; build elsewhere with cmake by hand"
        exit 5
    fi
    exec 9>"$root/build/.lock"
    flock 9
    : >"$log"
    install_missing "$@"
    configure "$tests"
    # On a terminal ninja shows its steps in one line, elsewhere those of a first build in many.
    local quiet=()
    [ -t 2 ] || [ ! -e "$build/bin/morphray" ] || quiet=(--quiet)
    (cd "$build" && ninja "${quiet[@]}" "${targets[@]}") </dev/null >&2 ||
        { say "the build failed"; exit 70; }
    exec 9>&-
}

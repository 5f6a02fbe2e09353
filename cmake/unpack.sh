# Unpacks Debian packages, of this machine's architecture or another one, without installing them. To be
# sourced by bash after cmake/setup.sh.

# other_apt ARCHITECTURE STATE ARGUMENT...: apt with a state of its own, in which nothing is installed.
other_apt() {
    local architecture=$1 state=$2
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

# has_packages FOLDER PACKAGE...: whether unpack_packages has filled it with these.
has_packages() { [ "$(cat "$1/packages" 2>/dev/null)" = "${*:2}" ]; }

# unpack_packages ARCHITECTURE FOLDER PACKAGE...: fills FOLDER with packages and all that they need.
unpack_packages() {
    local architecture=$1 folder=$2 package link
    shift 2
    say "fetching packages of $architecture"
    rm -rf "$folder" "$folder.apt"
    { other_apt "$architecture" "$folder.apt" update &&
        other_apt "$architecture" "$folder.apt" install --download-only "$@"; } ||
        show_log_and_exit 4 "packages of $architecture could not be fetched"
    for link in bin lib lib64 sbin; do
        mkdir -p "$folder/usr/$link"
        ln -s "usr/$link" "$folder/$link"
    done
    for package in "$folder.apt"/archives/*.deb; do
        dpkg-deb --fsys-tarfile "$package" | tar -x -C "$folder" --keep-directory-symlink
    done
    # Links to absolute paths would lead into this machine.
    find "$folder" -lname '/*' -print0 | while IFS= read -r -d '' link; do
        ln -srfn "$folder$(readlink "$link")" "$link"
    done
    rm -rf "$folder.apt"
    printf '%s\n' "$*" >"$folder/packages"
}

# unpack_aarch64_libraries: fills build/aarch64-root, unless it has what cmake/packages.txt lists, for
# cmake/aarch64/toolchain.cmake. What was built with others is removed.
unpack_aarch64_libraries() {
    local folder=$root/build/aarch64-root wanted
    # The standard library is that of the compiler's version.
    mapfile -t wanted < <(packages aarch64-library)
    wanted+=("libstdc++-$(aarch64-linux-gnu-g++ -dumpversion)-dev")
    has_packages "$folder" "${wanted[@]}" && return
    unpack_packages arm64 "$folder" "${wanted[@]}"
    rm -rf "$root/build/aarch64"
}

# cmake -D NAMES=g++,cmake -D DPKG_QUERY=program -D TEMPLATE=file.h.in -D OUTPUT=file.h -P build_packages.cmake: writes
# the versions of those packages that are installed, when they change, so that the header's few includers are
# compiled again.
string(REPLACE "," ";" names "${NAMES}")
set(PACKAGES)
set(COUNT 0)
if(names)
    # A package that is not installed is an error of dpkg-query, which goes on.
    execute_process(COMMAND ${DPKG_QUERY} -W -f "\${Package} \${Version} \${db:Status-Status}\\n" ${names}
        OUTPUT_VARIABLE lines ERROR_QUIET)
    # A package of two architectures has one version.
    string(REGEX MATCHALL "[^ \n]+ [^ \n]+ installed" lines "${lines}")
    list(REMOVE_DUPLICATES lines)
    list(SORT lines)
    list(LENGTH lines COUNT)
    foreach(line IN LISTS lines)
        string(REGEX REPLACE "^([^ ]+) ([^ ]+) installed$" "\n    {\"\\1\", \"\\2\"}," line "${line}")
        string(APPEND PACKAGES "${line}")
    endforeach()
endif()
configure_file(${TEMPLATE} ${OUTPUT} @ONLY)

# The target morphray_manual: man pages and completions from the program's own help, so that they
# are never older than the program.
set(manual_source ${CMAKE_CURRENT_LIST_DIR})
set(manual ${PROJECT_BINARY_DIR}/manual)
file(GLOB manual_scripts CONFIGURE_DEPENDS ${manual_source}/*.sh ${manual_source}/*.awk)
add_custom_command(OUTPUT ${manual}/stamp
    COMMAND sh ${manual_source}/generate.sh $<TARGET_FILE:morphray> ${PROJECT_VERSION} ${manual}
    DEPENDS morphray ${manual_scripts}
    COMMENT "Writing man pages and completions" VERBATIM)
add_custom_target(morphray_manual ALL DEPENDS ${manual}/stamp)

install(DIRECTORY ${manual}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program)
install(FILES ${manual}/completions/morphray.bash RENAME morphray
    DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/bash-completion/completions COMPONENT program)
install(FILES ${manual}/completions/_morphray DESTINATION ${MORPHRAY_ZSH_DIR} COMPONENT program)
install(FILES ${manual}/completions/morphray.fish
    DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/fish/vendor_completions.d COMPONENT program)

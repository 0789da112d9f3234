# Manual pages and completions, printed by the program after each of its links, in the folder
# manuals of the build. A cross-built program runs only with CMAKE_CROSSCOMPILING_EMULATOR: without
# it there are none.
if(WINDSPLAT_SANITIZE OR (CMAKE_CROSSCOMPILING AND NOT CMAKE_CROSSCOMPILING_EMULATOR))
  return()
endif()
set(manuals ${CMAKE_CURRENT_BINARY_DIR}/manuals)
set(printer ${CMAKE_CROSSCOMPILING_EMULATOR} $<TARGET_FILE:windsplat>)
add_custom_command(TARGET windsplat POST_BUILD VERBATIM
  COMMAND ${CMAKE_COMMAND} "-DPROGRAM=${printer}" -DFOLDER=${manuals}
    -P ${CMAKE_CURRENT_LIST_DIR}/write_manuals.cmake)
install(DIRECTORY ${manuals}/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT runtime
  FILES_MATCHING PATTERN *.1.gz PATTERN completions EXCLUDE)
install(FILES ${manuals}/completions/bash RENAME windsplat OPTIONAL COMPONENT runtime
  DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
install(FILES ${manuals}/completions/zsh RENAME _windsplat OPTIONAL COMPONENT runtime
  DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions)
install(FILES ${manuals}/completions/fish RENAME windsplat.fish OPTIONAL COMPONENT runtime
  DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)

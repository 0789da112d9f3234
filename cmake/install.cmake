# What `cmake --install` installs, below the prefix and with DESTDIR. Components: runtime (program,
# unit, settings, documents), vtk (windsplat-vtk), development.
install(TARGETS windsplat RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT runtime)

install(FILES README.md CHANGELOG.md LICENSE SECURITY.md COMPONENT runtime
  DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY docs/user DESTINATION ${CMAKE_INSTALL_DOCDIR}/docs COMPONENT runtime)
install(FILES deploy/examples/windsplat.json deploy/compose.yaml COMPONENT runtime
  DESTINATION ${CMAKE_INSTALL_DOCDIR}/examples)

# The unit names the program and its settings, whose folders follow from the prefix of
# `cmake --install`: settings are in /etc for /usr and /usr/local, else in the prefix. Those of an
# earlier installation stay as they are.
configure_file(${CMAKE_CURRENT_LIST_DIR}/install_unit.cmake.in install_unit.cmake @ONLY)
install(SCRIPT ${CMAKE_CURRENT_BINARY_DIR}/install_unit.cmake COMPONENT runtime)

include(${CMAKE_CURRENT_LIST_DIR}/manuals.cmake)
if(WINDSPLAT_HAS_VTK)
  install(FILES server/vtk_loader/windsplat-vtk.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1
    COMPONENT vtk)
endif()

# libwindsplat, the library of library/windsplat/windsplat.hpp: the same code as the program's, of
# which only the declarations of that header are visible. Components: library, development.
option(WINDSPLAT_LIBRARY "Build libwindsplat" ON)
if(NOT WINDSPLAT_LIBRARY OR WINDSPLAT_SANITIZE)
  return()
endif()
file(GLOB library_sources CONFIGURE_DEPENDS library/*.cpp)
add_library(windsplat_facade SHARED ${library_sources})
set_target_properties(windsplat_facade PROPERTIES OUTPUT_NAME windsplat EXPORT_NAME windsplat
  VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}
  CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
target_link_libraries(windsplat_facade PRIVATE windsplat_frame windsplat_scene windsplat_data
  windsplat_protocol)
target_include_directories(windsplat_facade PRIVATE ${PROJECT_SOURCE_DIR}
  INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
target_compile_features(windsplat_facade INTERFACE cxx_std_17)
set(names ${PROJECT_SOURCE_DIR}/library/cmake/names.map)
target_link_options(windsplat_facade PRIVATE -Wl,--version-script=${names} -Wl,--as-needed
  -Wl,-z,defs)
set_property(TARGET windsplat_facade PROPERTY LINK_DEPENDS ${names})

install(TARGETS windsplat_facade EXPORT windsplat COMPONENT library
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} NAMELINK_COMPONENT development)
install(FILES library/windsplat/windsplat.hpp COMPONENT development
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/windsplat)
set(config_folder ${CMAKE_INSTALL_LIBDIR}/cmake/windsplat)
install(EXPORT windsplat NAMESPACE windsplat:: FILE windsplatConfig.cmake COMPONENT development
  DESTINATION ${config_folder})
include(CMakePackageConfigHelpers)
write_basic_package_version_file(windsplatConfigVersion.cmake COMPATIBILITY SameMinorVersion)
file(RELATIVE_PATH prefix_from_pc /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
string(REGEX REPLACE "/$" "" prefix_from_pc ${prefix_from_pc})
configure_file(library/cmake/windsplat.pc.in windsplat.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/windsplatConfigVersion.cmake COMPONENT development
  DESTINATION ${config_folder})
install(FILES ${PROJECT_BINARY_DIR}/windsplat.pc COMPONENT development
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)

# windsplat-vtk, the loader of cases of OpenFOAM and EnSight, is built where VTK's headers and
# libraries are (scripts/setup vtk). The package libvtk9-dev cannot be installed beside Boost 1.81:
# the headers may lie in build/vtk, and the libraries are found by the names of the runtime package.
set(WINDSPLAT_VTK AUTO CACHE STRING "Build windsplat-vtk: AUTO, ON or OFF")
set(WINDSPLAT_VTK_ROOT ${PROJECT_SOURCE_DIR}/build/vtk CACHE PATH "Another folder of VTK")
set(WINDSPLAT_HAS_VTK OFF)
# A sanitizer replaces the functions of files that windsplat-vtk replaces.
if(WINDSPLAT_VTK STREQUAL "OFF" OR WINDSPLAT_SANITIZE)
  return()
endif()

set(vtk_version 9.1)
find_path(VTK_INCLUDE vtkOpenFOAMReader.h
  HINTS ${WINDSPLAT_VTK_ROOT}/usr/include/vtk-${vtk_version} /usr/include/vtk-${vtk_version})
set(vtk_libraries "")
set(vtk_missing "")
foreach(part vtkCommonCore vtkCommonDataModel vtkCommonExecutionModel vtkCommonMisc vtkCommonSystem
    vtkIOEnSight vtkIOGeometry vtksys)
  find_library(LIBRARY_${part} NAMES lib${part}-${vtk_version}.so.1 ${part}-${vtk_version}
    HINTS ${WINDSPLAT_VTK_ROOT}/usr/lib/${CMAKE_LIBRARY_ARCHITECTURE})
  list(APPEND vtk_libraries ${LIBRARY_${part}})
  if(NOT LIBRARY_${part})
    list(APPEND vtk_missing lib${part}-${vtk_version})
  endif()
endforeach()
if(NOT VTK_INCLUDE)
  list(APPEND vtk_missing "headers of VTK ${vtk_version}")
endif()
if(vtk_missing)
  list(JOIN vtk_missing ", " vtk_missing)
  if(WINDSPLAT_VTK STREQUAL "ON")
    message(FATAL_ERROR "WINDSPLAT_VTK is ON, but not found: ${vtk_missing} (scripts/setup vtk)")
  endif()
  message(STATUS "windsplat-vtk is not built: not found: ${vtk_missing} (scripts/setup vtk)")
  return()
endif()

set(WINDSPLAT_HAS_VTK ON)
file(GLOB vtk_sources CONFIGURE_DEPENDS server/vtk_loader/*.cpp)
add_executable(windsplat-vtk ${vtk_sources})
set_target_properties(windsplat-vtk PROPERTIES UNITY_BUILD OFF)
target_include_directories(windsplat-vtk SYSTEM PRIVATE ${VTK_INCLUDE})
target_link_libraries(windsplat-vtk PRIVATE windsplat_data PkgConfig::ZLIB ${vtk_libraries})
windsplat_check_containers(windsplat-vtk)
# Libraries call the functions that the program defines (server/vtk_loader/file_functions.cpp).
foreach(name fopen fopen64 stat lstat stat64 lstat64 access opendir readdir readdir64 closedir)
  target_link_options(windsplat-vtk PRIVATE -Wl,--export-dynamic-symbol=${name})
endforeach()
get_filename_component(vtk_folder ${LIBRARY_vtkIOGeometry} DIRECTORY)
if(vtk_folder MATCHES "^${WINDSPLAT_VTK_ROOT}/")
  # Libraries that are not installed find each other by DT_RPATH only.
  target_link_options(windsplat-vtk PRIVATE -Wl,--disable-new-dtags -Wl,-rpath,${vtk_folder}
    -Wl,-rpath-link,${vtk_folder})
  install(CODE "message(WARNING \"windsplat-vtk uses VTK's libraries in ${vtk_folder}: keep it\")"
    COMPONENT vtk)
endif()
add_dependencies(windsplat windsplat-vtk)
install(TARGETS windsplat-vtk RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT vtk)

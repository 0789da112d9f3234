# Selects the linker. The presets use mold where it is installed: it takes a tenth of the time of
# the compiler's own.
set(WINDSPLAT_LINKER "" CACHE STRING "mold, lld, gold or bfd; empty: the compiler's own")
if(WINDSPLAT_LINKER)
  find_program(WINDSPLAT_LINKER_PROGRAM NAMES ${WINDSPLAT_LINKER} ld.${WINDSPLAT_LINKER})
  if(WINDSPLAT_LINKER_PROGRAM)
    add_link_options(-fuse-ld=${WINDSPLAT_LINKER})
  else()
    message(STATUS "No linker ${WINDSPLAT_LINKER} (Debian: apt-get install ${WINDSPLAT_LINKER}): "
      "the compiler's own links, which takes longer")
  endif()
endif()

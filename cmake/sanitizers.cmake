# Included after the libraries. Presets dev and tsan compile without optimisation, which takes less
# than half the time; code that draws pixels is optimised nevertheless.
if(WINDSPLAT_SANITIZE)
  foreach(part base engine image)
    target_compile_options(windsplat_${part} PRIVATE -O1)
  endforeach()
endif()

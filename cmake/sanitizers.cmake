# Included after the libraries. Presets dev and tsan compile without optimisation, which takes less
# than half the time; code that processes single samples or pixels is optimised nevertheless.
if(WINDSPLAT_SANITIZE)
  foreach(part base scene engine image frame)
    target_compile_options(windsplat_${part} PRIVATE -O1)
  endforeach()
endif()

# Included after the libraries. Preset dev and tsan compile without optimisation, which takes less
# than half as long; what computes a sample or a pixel at a time is optimised all the same.
if(WINDSPLAT_SANITIZE)
  foreach(part base scene engine image frame)
    target_compile_options(windsplat_${part} PRIVATE -O1)
  endforeach()
endif()

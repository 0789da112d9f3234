# The kernels, one translation unit an instruction set, chosen at run time (kernels/dispatch.cpp).
# Of Highway's vectors only the headers: the flags choose their target. Fused multiply-adds stand
# where the source says so: no contraction, no reassociation. Neither errno nor floating-point traps
# nor the sign of zero are read, and masked samples (NaN) are told by their bits before any
# arithmetic: that lets minima, maxima, square roots and selections be vectorised.
set(kernel_dir ${CMAKE_CURRENT_LIST_DIR})
set(kernel_flags -O3 -ffp-contract=off -fno-math-errno -fno-trapping-math -fno-signed-zeros
    -ffinite-math-only)
# GCC 12 takes a function that fills a brick's arrays for one without effect and drops the call
# (tests/numerics/curved_test.cpp sees an empty picture); without these two analyses it does not.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  list(APPEND kernel_flags -fno-ipa-pure-const -fno-ipa-modref)
endif()
target_sources(windsplat_engine PRIVATE ${kernel_dir}/dispatch.cpp ${kernel_dir}/portable.cpp)
set_source_files_properties(${kernel_dir}/portable.cpp PROPERTIES COMPILE_OPTIONS "${kernel_flags}")

if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  target_compile_definitions(windsplat_engine PRIVATE WINDSPLAT_X86_TARGETS=1)
  foreach(target IN ITEMS "sse4 x86-64-v2" "avx2 x86-64-v3" "avx512 x86-64-v4")
    separate_arguments(target)
    list(GET target 0 name)
    list(GET target 1 processor)
    target_sources(windsplat_engine PRIVATE ${kernel_dir}/${name}.cpp)
    set_source_files_properties(${kernel_dir}/${name}.cpp PROPERTIES
      COMPILE_OPTIONS "${kernel_flags};-march=${processor}"
      COMPILE_DEFINITIONS HWY_DISABLE_PCLMUL_AES)
  endforeach()
endif()

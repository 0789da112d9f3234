# The kernels, one translation unit per instruction set, selected at run time
# (kernels/dispatch.cpp). Only the headers of Highway are used; the flags select its target. Fused
# multiply-add is used only where the source requests it: no contraction, no reassociation. errno,
# floating-point traps and the sign of zero are not used, so that minima, maxima, square roots and
# selections vectorise. NaN must be preserved (no -ffinite-math-only): masked samples are NaN.
set(kernel_dir ${CMAKE_CURRENT_LIST_DIR})
set(kernel_speed -O3)
if(WINDSPLAT_SANITIZE)
  set(kernel_speed -O1 -DWINDSPLAT_SANITIZED)
endif()
set(kernel_flags ${kernel_speed} -ffp-contract=off -fno-math-errno -fno-trapping-math
    -fno-signed-zeros)
target_sources(windsplat_engine PRIVATE
  ${kernel_dir}/dispatch.cpp ${kernel_dir}/targets/portable.cpp)
set_source_files_properties(${kernel_dir}/targets/portable.cpp PROPERTIES
  COMPILE_OPTIONS "${kernel_flags}"
  SKIP_UNITY_BUILD_INCLUSION ON)

set(kernel_targets "")
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  set(kernel_targets sse4 avx2 avx512)
elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|arm64")
  set(kernel_targets neon)
endif()
set(WINDSPLAT_KERNELS ${kernel_targets} CACHE STRING "Instruction sets besides the portable one")
set(kernel_processor_sse4 x86-64-v2)
set(kernel_processor_avx2 x86-64-v3)
set(kernel_processor_avx512 x86-64-v4)
# Highway's NEON functions are declared with the extension `crypto`, and can be inlined only into
# functions that have it, too; the kernels use none of its instructions.
set(kernel_processor_neon armv8-a+crypto)
# GCC 12 warns there, and nowhere else, of pass_sorted()'s share, which is written where it is read.
set(kernel_warnings_neon $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
foreach(name IN LISTS WINDSPLAT_KERNELS)
  if(NOT name IN_LIST kernel_targets)
    continue()
  endif()
  string(TOUPPER ${name} upper)
  target_compile_definitions(windsplat_engine PRIVATE WINDSPLAT_KERNELS_${upper}=1)
  target_sources(windsplat_engine PRIVATE ${kernel_dir}/targets/${name}.cpp)
  set_source_files_properties(${kernel_dir}/targets/${name}.cpp PROPERTIES
    COMPILE_OPTIONS
      "${kernel_flags};-march=${kernel_processor_${name}};${kernel_warnings_${name}}"
    COMPILE_DEFINITIONS HWY_DISABLE_PCLMUL_AES
    SKIP_UNITY_BUILD_INCLUSION ON)
endforeach()

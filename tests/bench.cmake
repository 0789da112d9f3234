# The benchmarks: run by hand (HACKING.md). A tiny run of each is a test, so that none can rot.
find_package(Python3 COMPONENTS Interpreter)
set(bench_dir ${CMAKE_CURRENT_LIST_DIR}/bench)
# What the engine is measured against is built plainly, without the vectoriser.
set_source_files_properties(${CMAKE_CURRENT_LIST_DIR}/numerics/naive_renderer.cpp
  PROPERTIES COMPILE_OPTIONS -O2)

add_library(bench_support STATIC ${bench_dir}/support.cpp)
target_link_libraries(bench_support PUBLIC windsplat_frame benchmark::benchmark)

# windsplat_bench(<name> <further sources...>)
function(windsplat_bench name)
  add_executable(${name} ${bench_dir}/${name}.cpp ${ARGN})
  target_link_libraries(${name} PRIVATE bench_support)
endfunction()

windsplat_bench(bench_frame ${CMAKE_CURRENT_LIST_DIR}/numerics/naive_renderer.cpp)
windsplat_bench(bench_kernels)
windsplat_bench(bench_stages ${bench_dir}/allocations.cpp)
windsplat_bench(bench_path)
windsplat_bench(bench_left_out)

foreach(name bench_frame bench_kernels bench_stages)
  add_test(NAME bench.${name} COMMAND ${name} --smoke)
  set_tests_properties(bench.${name} PROPERTIES LABELS bench TIMEOUT 300)
endforeach()

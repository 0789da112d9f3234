# The whole-frame benchmark: not a test, run by hand (HACKING.md).
add_executable(bench_frame
  ${CMAKE_CURRENT_LIST_DIR}/bench/bench_frame.cpp
  ${CMAKE_CURRENT_LIST_DIR}/numerics/naive_renderer.cpp)
target_link_libraries(bench_frame PRIVATE windsplat_engine benchmark::benchmark)
# What the engine is measured against is built plainly, without the vectoriser.
set_source_files_properties(${CMAKE_CURRENT_LIST_DIR}/numerics/naive_renderer.cpp
  PROPERTIES COMPILE_OPTIONS -O2)

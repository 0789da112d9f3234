# The benchmarks of whole frames: not tests, run by hand (HACKING.md).
add_executable(bench_frame
  ${CMAKE_CURRENT_LIST_DIR}/bench/bench_frame.cpp
  ${CMAKE_CURRENT_LIST_DIR}/numerics/naive_renderer.cpp)
target_link_libraries(bench_frame PRIVATE windsplat_engine benchmark::benchmark)
# What the engine is measured against is built plainly, without the vectoriser.
set_source_files_properties(${CMAKE_CURRENT_LIST_DIR}/numerics/naive_renderer.cpp
  PROPERTIES COMPILE_OPTIONS -O2)

add_executable(bench_left_out ${CMAKE_CURRENT_LIST_DIR}/bench/bench_left_out.cpp)
target_link_libraries(bench_left_out PRIVATE windsplat_frame benchmark::benchmark)

add_executable(bench_picture ${CMAKE_CURRENT_LIST_DIR}/bench/bench_picture.cpp)
target_link_libraries(bench_picture PRIVATE windsplat_frame benchmark::benchmark)

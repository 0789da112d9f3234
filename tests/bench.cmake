# The benchmarks are run manually (docs/benchmarks). A tiny run of each is a test, so that all
# remain usable.
set(bench_dir ${CMAKE_CURRENT_LIST_DIR}/bench)
# The baseline for the engine is compiled for the baseline instruction set with -O2, whose limited
# vectorisation in g++ 12 is intended, without the additional optimisations of -O3.
set_source_files_properties(${CMAKE_CURRENT_LIST_DIR}/numerics/naive_order.cpp
  ${CMAKE_CURRENT_LIST_DIR}/numerics/naive_renderer.cpp
  PROPERTIES COMPILE_OPTIONS -O2 SKIP_PRECOMPILE_HEADERS ON)

# Times under a sanitizer are meaningless.
if(WINDSPLAT_SANITIZE)
  return()
endif()

add_library(bench_support STATIC ${bench_dir}/support.cpp)
target_link_libraries(bench_support PUBLIC windsplat_frame benchmark::benchmark)

# windsplat_bench(<name> <further sources...>)
function(windsplat_bench name)
  add_executable(${name} ${bench_dir}/${name}.cpp ${ARGN})
  target_link_libraries(${name} PRIVATE bench_support)
endfunction()

set(naive_dir ${CMAKE_CURRENT_LIST_DIR}/numerics)
windsplat_bench(bench_frame ${bench_dir}/scenes/scene_set.cpp ${bench_dir}/scenes/scene_times.cpp
  ${naive_dir}/naive_renderer.cpp ${naive_dir}/naive_order.cpp ${naive_dir}/trial_fields.cpp)
target_link_libraries(bench_frame PRIVATE windsplat_truth)
windsplat_bench(bench_kernels)
windsplat_bench(bench_stages ${bench_dir}/allocations.cpp)
windsplat_bench(bench_path)
windsplat_bench(bench_left_out ${bench_dir}/scenes/skipped_changes.cpp
  ${naive_dir}/trial_fields.cpp)
windsplat_bench(bench_estimates ${bench_dir}/scenes/scene_set.cpp
  ${bench_dir}/scenes/time_estimates.cpp ${bench_dir}/scenes/odd_estimates.cpp
  ${bench_dir}/scenes/part_estimates.cpp
  ${naive_dir}/trial_fields.cpp
  ${naive_dir}/family/family.cpp)
windsplat_bench(bench_pool)
add_executable(bench_direction ${bench_dir}/direction/bench_direction.cpp
  ${bench_dir}/direction/cues.cpp ${bench_dir}/direction/fields.cpp
  ${bench_dir}/direction/tally.cpp ${bench_dir}/direction/truth.cpp
  ${naive_dir}/trial_fields.cpp)
target_link_libraries(bench_direction PRIVATE bench_support)
add_executable(bench_light ${bench_dir}/scenes/bench_light.cpp)
target_link_libraries(bench_light PRIVATE bench_support)
windsplat_bench(bench_picture)
windsplat_bench(bench_load)
target_link_libraries(bench_load PRIVATE PkgConfig::NETCDF PkgConfig::ZSTD PkgConfig::BLOSC)

# windsplat_smoke(<name> <command...>)
function(windsplat_smoke name)
  add_test(NAME bench.${name} COMMAND ${ARGN} WORKING_DIRECTORY ${PROJECT_BINARY_DIR})
  set_tests_properties(bench.${name} PROPERTIES LABELS bench TIMEOUT 300
    ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
endfunction()

# Sanitizers increase memory use, so memory is not measured there.

windsplat_smoke(frame bench_frame --smoke)
windsplat_smoke(scenes bench_frame --scenes --smoke --rounds=1)
windsplat_smoke(kernels bench_kernels --smoke)
windsplat_smoke(stages bench_stages --smoke)
windsplat_smoke(estimates bench_estimates --measure=bench_estimates.csv --list=bench_estimates.csv
  --members=1 --scenes=1 --views=1)
windsplat_smoke(direction bench_direction --smoke)
windsplat_smoke(left_out bench_left_out --trials=24 --field=front --smoke)
windsplat_smoke(light bench_light --smoke)
windsplat_smoke(picture bench_picture --benchmark_filter=640x480 --benchmark_min_time=0.001)
file(WRITE ${PROJECT_BINARY_DIR}/bench_views.jsonl "{\"image\":{\"width\":32,\"height\":24}}\n")
windsplat_smoke(path bench_path tornado bench_views.jsonl bench_view.png)
windsplat_smoke(memory python3 ${bench_dir}/memory.py --program=$<TARGET_FILE:windsplat>
  --frames=4 --sessions=2 --max-mb=115)
windsplat_smoke(load bench_load --program=$<TARGET_FILE:windsplat> --dims=32x16x8 --rounds=1)
windsplat_smoke(playback python3 ${bench_dir}/playback.py --program=$<TARGET_FILE:windsplat>
  --dims=32x16x8 --steps=6 --size=64x48 --memory-limit=512M)
windsplat_smoke(large_store python3 ${bench_dir}/files/large_store.py
  --program=$<TARGET_FILE:windsplat> --data=tornado:96x96x64 --memory-limit=192M --size=64x48
  --seconds=1 --disk-mib=8)
windsplat_smoke(remote_store /usr/bin/python3 ${bench_dir}/files/remote_store.py
  --program=$<TARGET_FILE:windsplat> --side=32 --delay=0.001)
windsplat_smoke(memory_limit python3 ${bench_dir}/playback.py
  --program=$<TARGET_FILE:windsplat> --sessions=8 --apart --steps=12 --seconds=8 --size=160x120
  --memory-limit=192M --check-memory)
windsplat_smoke(budgets python3 ${bench_dir}/budgets.py --program=$<TARGET_FILE:windsplat>
  --dataset=climate:32x16x6 --size=160x120 --frames=10 --rest=1 --budgets=16,66 --max-errors=0.05)
windsplat_smoke(links python3 ${bench_dir}/links.py --program=$<TARGET_FILE:windsplat> --smoke)
windsplat_smoke(preauth_cost python3 ${bench_dir}/preauth_cost.py --program=$<TARGET_FILE:windsplat>
  --count=2 --key=P-256)
windsplat_smoke(viewers python3 ${bench_dir}/viewers.py --program=$<TARGET_FILE:windsplat> --smoke)
windsplat_smoke(moving_camera python3 ${bench_dir}/viewers.py --program=$<TARGET_FILE:windsplat>
  --dataset=climate:32x16x8 --compare=${PROJECT_SOURCE_DIR}/docs/benchmarks/everything.json
  --rounds=1 --seconds=1 --size=64x48)
# Without VTK it prints a message and succeeds.
windsplat_smoke(peers python3 ${bench_dir}/peers/compare.py --build=${PROJECT_BINARY_DIR}
  --frames=1 --sizes=64x48 --dims=32x16x8 --slow)
windsplat_smoke(peers_only python3 ${bench_dir}/peers/compare.py --only=nothing-matches)
set_tests_properties(bench.peers_only PROPERTIES
  PASS_REGULAR_EXPRESSION "no VTK configuration is named 'nothing-matches'")
windsplat_smoke(soak python3 ${bench_dir}/soak.py --program=$<TARGET_FILE:windsplat> --smoke)
windsplat_smoke(overload python3 ${bench_dir}/load.py --program=$<TARGET_FILE:windsplat> --smoke)
windsplat_smoke(soak_tls python3 ${bench_dir}/soak.py --program=$<TARGET_FILE:windsplat> --smoke
  --tls)

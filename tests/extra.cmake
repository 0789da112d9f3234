# Tests other than C++ ones: style, size and include directions of the tree; and the benchmarks.
include(${CMAKE_CURRENT_LIST_DIR}/bench.cmake OPTIONAL)

# Under the thread sanitizer integration_tests covers the daemon.
if(sanitizer STREQUAL "TSAN")
  return()
endif()

# Not repeated under sanitizers, which cannot find errors in these tests.
function(windsplat_tidy_test name)
  if(WINDSPLAT_SANITIZE)
    return()
  endif()
  add_test(NAME tidy.${name} COMMAND ${ARGN} WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
  set_tests_properties(tidy.${name} PROPERTIES LABELS tidy TIMEOUT 120
    ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
endfunction()

windsplat_tidy_test(includes python3 tests/tidy/check_includes.py)
windsplat_tidy_test(links python3 tests/tidy/check_links.py)
windsplat_tidy_test(routes python3 tests/tidy/check_routes.py)
windsplat_tidy_test(web_imports python3 tests/tidy/check_web_imports.py)
windsplat_tidy_test(local_names python3 tests/tidy/check_local_names.py)
windsplat_tidy_test(style python3 tests/tidy/check_style.py)
windsplat_tidy_test(self_test python3 tests/tidy/self_test.py)
windsplat_tidy_test(format scripts/format --check)
windsplat_tidy_test(spelling python3 tests/tidy/check_spelling.py)
windsplat_tidy_test(runner python3 tests/run/self_test.py)

# Whether the kernels' flags prevent the removal of calls by this compiler.
add_executable(dropped_call ${CMAKE_CURRENT_LIST_DIR}/toolchain/dropped_call.cpp)
target_compile_options(dropped_call PRIVATE ${kernel_flags})
add_test(NAME toolchain.dropped_call COMMAND dropped_call)
set_tests_properties(toolchain.dropped_call PROPERTIES LABELS unit TIMEOUT 60)

# Real files against independent readers, and mutated files against a daemon. The limits on time
# here and below only end what hangs: beside a compile, with a sanitizer, some tests take minutes.
function(windsplat_program_test name)
  add_test(NAME files.${name} COMMAND ${ARGN} WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
  set_tests_properties(files.${name} PROPERTIES LABELS integration TIMEOUT 900
    ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
endfunction()

# Debian's python, which has access to Debian's modules.
find_program(SYSTEM_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH REQUIRED)
# Two files of each of the 17 formats under ASan, ten others in the release build.
set(drawn_options --first=34 --count=170)
if(WINDSPLAT_SANITIZE)
  set(drawn_options --count=34 --peak-mib=1500)  # sanitizers retain freed memory
endif()
windsplat_program_test(service_manager python3 tests/integration/service_manager.py
  --program=$<TARGET_FILE:windsplat>)
# Mutated datasets: opened, compared with the known values, rendered.
windsplat_program_test(drawn ${SYSTEM_PYTHON} tests/fuzz/draw_mutants.py
  --program=$<TARGET_FILE:windsplat> ${drawn_options})
# Mutated and well-formed files. Under the sanitizers the fuzzers replay small files of every
# format, and --thorough has the mutated ones.
if(NOT WINDSPLAT_SANITIZE)
  windsplat_program_test(spoiled python3 tests/fuzz/mutate_files.py
    --program=$<TARGET_FILE:windsplat> --count=300)
  windsplat_program_test(real ${SYSTEM_PYTHON} tests/integration/real_files.py
    --program=$<TARGET_FILE:windsplat>)
  windsplat_program_test(models ${SYSTEM_PYTHON} tests/integration/model_files.py
    --program=$<TARGET_FILE:windsplat>)
  windsplat_program_test(data_hosts ${SYSTEM_PYTHON} tests/integration/data_hosts.py
    --program=$<TARGET_FILE:windsplat>)
  windsplat_program_test(host_parts ${SYSTEM_PYTHON} tests/integration/host_parts.py
    --program=$<TARGET_FILE:windsplat>)
  windsplat_program_test(remote_stores ${SYSTEM_PYTHON} tests/integration/levels/remote_stores.py
    --program=$<TARGET_FILE:windsplat>)
  windsplat_program_test(addresses ${SYSTEM_PYTHON} tests/integration/addresses.py
    --program=$<TARGET_FILE:windsplat>)
  windsplat_program_test(values ${SYSTEM_PYTHON} tests/integration/values.py
    --program=$<TARGET_FILE:windsplat>)
  windsplat_program_test(boxes ${SYSTEM_PYTHON} tests/integration/boxes.py
    --program=$<TARGET_FILE:windsplat>)
  windsplat_program_test(convert ${SYSTEM_PYTHON} tests/integration/convert/convert.py
    --program=$<TARGET_FILE:windsplat>)
  windsplat_program_test(interrupted ${SYSTEM_PYTHON} tests/integration/convert/interrupted.py
    --program=$<TARGET_FILE:windsplat>)
  windsplat_program_test(outputs ${SYSTEM_PYTHON} tests/integration/convert/outputs.py
    --program=$<TARGET_FILE:windsplat>)
  windsplat_program_test(levels ${SYSTEM_PYTHON} tests/integration/levels/levels.py
    --program=$<TARGET_FILE:windsplat>)
  windsplat_program_test(stand_ins ${SYSTEM_PYTHON} tests/integration/levels/stand_ins.py
    --program=$<TARGET_FILE:windsplat>)
  windsplat_program_test(openapi ${SYSTEM_PYTHON} tests/integration/openapi/openapi_requests.py
    --program=$<TARGET_FILE:windsplat> --count=600)
  windsplat_program_test(uploads ${SYSTEM_PYTHON} tests/integration/uploads.py
    --program=$<TARGET_FILE:windsplat>)
  windsplat_program_test(archives ${SYSTEM_PYTHON} tests/integration/archives.py
    --program=$<TARGET_FILE:windsplat>)
  windsplat_program_test(scripts python3 tests/integration/scripts_test.py)
  windsplat_program_test(sbom python3 tests/integration/sbom.py --program=$<TARGET_FILE:windsplat>)
  windsplat_program_test(install python3 tests/integration/install_test.py
    --build=${PROJECT_BINARY_DIR})
  if(WINDSPLAT_LIBRARY)
    windsplat_program_test(library python3 tests/library/library_test.py
      --build=${PROJECT_BINARY_DIR})
  endif()
  windsplat_program_test(hardening python3 tests/tidy/check_hardening.py $<TARGET_FILE:windsplat>)
endif()

# The program's results as text must agree in two runs. Pictures are omitted, as they take a minute.
if(NOT WINDSPLAT_SANITIZE)
  add_executable(session_transcript ${CMAKE_CURRENT_LIST_DIR}/fingerprint/session_transcript.cpp)
  target_link_libraries(session_transcript PRIVATE windsplat_session nlohmann_json::nlohmann_json)
  windsplat_program_test(fingerprint scripts/fingerprint --check --only=requests,sessions,inspect
    --program=$<TARGET_FILE:windsplat> --transcripts=$<TARGET_FILE:session_transcript>)
endif()

# HTTP and WebSocket edge cases against a daemon. Sanitizers retain freed memory, so memory growth
# is not checked there, and their leak detection does not work under strace. Of the sizes at
# boundaries they test a sample, on a small dataset.
set(edge_options)
set(boundary_options)
set(attack_options)
if(WINDSPLAT_SANITIZE)
  set(edge_options --growth-kib=0)
  set(boundary_options --count=1200 --edge=20)
  set(attack_options --strace=no)
endif()
function(windsplat_edge_test name script)
  add_test(NAME edge.${name} COMMAND python3 tests/edge/${script}.py
    --program=$<TARGET_FILE:windsplat> ${edge_options} ${ARGN}
    WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
  set_tests_properties(edge.${name} PROPERTIES LABELS integration TIMEOUT 900
    ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
endfunction()

windsplat_edge_test(rfc6455 rfc6455)
windsplat_edge_test(http11 http11)
windsplat_edge_test(boundaries boundaries ${boundary_options})
foreach(attack chunked_trailer external_files url_paths)
  windsplat_edge_test(attack_${attack} attacks --attack=${attack} ${attack_options})
endforeach()

# Latencies of other clients, which a sanitizer would change.
if(NOT WINDSPLAT_SANITIZE)
  add_test(NAME edge.handshakes COMMAND python3 tests/edge/handshakes.py
    --program=$<TARGET_FILE:windsplat> --slack=8 WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
  set_tests_properties(edge.handshakes PROPERTIES LABELS integration TIMEOUT 900
    SKIP_RETURN_CODE 77 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
endif()

# The recipes of docs/user/deploy, with the servers that are installed, and the web site.
if(NOT WINDSPLAT_SANITIZE)
  function(windsplat_deploy_test name)
    add_test(NAME deploy.${name} COMMAND ${SYSTEM_PYTHON} ${ARGN}
      --program=$<TARGET_FILE:windsplat> WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
    set_tests_properties(deploy.${name} PROPERTIES LABELS integration TIMEOUT 120
      SKIP_RETURN_CODE 77 ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
  endfunction()
  windsplat_deploy_test(nginx tests/deploy/proxies.py --server=nginx)
  windsplat_deploy_test(caddy tests/deploy/proxies.py --server=caddy)
  windsplat_deploy_test(files tests/deploy/files.py)
  windsplat_deploy_test(site tests/deploy/site.py)
endif()

# Longer runs of the short tests above.
function(windsplat_long_test name)
  add_test(NAME thorough.${name} COMMAND ${ARGN} --program=$<TARGET_FILE:windsplat>
    WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
  set_tests_properties(thorough.${name} PROPERTIES LABELS thorough TIMEOUT 3600 COST 2000
    ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
endfunction()

if(WINDSPLAT_SANITIZE)
  windsplat_long_test(spoiled python3 tests/fuzz/mutate_files.py --count=300)
  windsplat_long_test(drawn ${SYSTEM_PYTHON} tests/fuzz/draw_mutants.py --count=68 --peak-mib=1500)
else()
  windsplat_long_test(spoiled python3 tests/fuzz/mutate_files.py --count=10000)
  windsplat_long_test(openapi ${SYSTEM_PYTHON} tests/integration/openapi/openapi_requests.py
    --count=10000 --seed=1)
  windsplat_long_test(drawn ${SYSTEM_PYTHON} tests/fuzz/draw_mutants.py --count=3400)
  windsplat_long_test(tutorial python3 tests/deploy/tutorial.py)
endif()

# Short rounds of every fault, and failing library calls by a preloaded library. That library
# replaces the allocator, so it cannot be combined with sanitizers.
function(windsplat_fault_test name script)
  add_test(NAME faults.${name} COMMAND python3 tests/faults/${script} ${ARGN}
    --program=$<TARGET_FILE:windsplat> --quick WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
  set_tests_properties(faults.${name} PROPERTIES LABELS integration TIMEOUT 1800 COST 1000
    ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
endfunction()

# Factor for asserted times: tests share the machine, and sanitizers are slow.
set(fault_slack 8)
if(WINDSPLAT_SANITIZE)
  set(fault_slack 20)
else()
  add_library(faults_shim SHARED ${CMAKE_CURRENT_LIST_DIR}/faults/shim.cpp)
  target_link_libraries(faults_shim PRIVATE ${CMAKE_DL_LIBS})
  target_compile_options(faults_shim PRIVATE -O1 -fno-builtin)
  windsplat_fault_test(inject inject.py --shim=$<TARGET_FILE:faults_shim> --slack=${fault_slack})
endif()
windsplat_fault_test(table faults.py --slack=${fault_slack})
if(WINDSPLAT_SANITIZE)
  # Minutes. The other tests of the daemon run the same code: signals, drawn, edge, integration.
  set_tests_properties(faults.table PROPERTIES LABELS "thorough;integration")
endif()
windsplat_fault_test(signals signals.py --slack=${fault_slack})

include(${CMAKE_CURRENT_LIST_DIR}/clients/python.cmake)

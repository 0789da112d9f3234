# The tests that are no C++: form, size and include directions of the tree; and the benchmarks.
include(${CMAKE_CURRENT_LIST_DIR}/bench.cmake OPTIONAL)

function(windsplat_tidy_test name)
  add_test(NAME tidy.${name} COMMAND ${ARGN} WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
  set_tests_properties(tidy.${name} PROPERTIES LABELS tidy TIMEOUT 120
    ENVIRONMENT PYTHONDONTWRITEBYTECODE=1)
endfunction()

windsplat_tidy_test(includes python3 tests/tidy/check_includes.py)
windsplat_tidy_test(style python3 tests/tidy/check_style.py)
windsplat_tidy_test(self_test python3 tests/tidy/self_test.py)
windsplat_tidy_test(format scripts/format --check)

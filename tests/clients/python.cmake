# Tests of the Python client (clients/python) against the real daemon, by Debian's Python. They
# begin early (COST), since they wait for kernels and daemons.
function(windsplat_python_test name)
  add_test(NAME clients.python_${name} COMMAND ${SYSTEM_PYTHON} -W ignore -m unittest ${ARGN}
    WORKING_DIRECTORY ${PROJECT_SOURCE_DIR}/tests/clients/python)
  set_tests_properties(clients.python_${name} PROPERTIES LABELS integration TIMEOUT 600 COST 500
    ENVIRONMENT "PYTHONDONTWRITEBYTECODE=1;WINDSPLAT=$<TARGET_FILE:windsplat>")
endfunction()

if(NOT WINDSPLAT_SANITIZE)
  windsplat_python_test(api test_documents test_start test_server test_uploads test_times
    test_frames test_widget)
  windsplat_python_test(xarray test_xarray)
  windsplat_python_test(notebooks test_notebooks)
  windsplat_python_test(package test_docs test_wheel)
endif()

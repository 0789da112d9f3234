# Hardening against memory errors, so that they terminate the program instead of being exploitable.
# tests/tidy/check_hardening.py checks the built program.
include(CheckPIESupported)
check_pie_supported()

add_compile_options(-fstack-protector-strong -Wformat -Wformat-security)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  add_compile_options(-fstack-clash-protection)
endif()
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  add_compile_options(-fcf-protection)
endif()
if(NOT WINDSPLAT_SANITIZE)
  # Fortified calls need optimisation; sanitizer builds detect more without them.
  add_compile_options($<$<CONFIG:Release>:-U_FORTIFY_SOURCE>
    $<$<CONFIG:Release>:-D_FORTIFY_SOURCE=3>)
endif()
add_link_options(-Wl,-z,relro -Wl,-z,now -Wl,-z,noexecstack -Wl,-z,separate-code)

# Bounds checks of standard containers, in all code that parses external data. The engine and the
# image codecs receive validated values only.
function(windsplat_check_containers target)
  target_compile_definitions(${target} PRIVATE $<$<CONFIG:Release>:_GLIBCXX_ASSERTIONS>)
endfunction()

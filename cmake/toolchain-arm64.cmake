# Cross compilation for arm64 with Debian's compiler (g++-aarch64-linux-gnu). The sysroot holds the
# headers and libraries of Debian's arm64 packages: scripts/build-arm64 makes it.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)

get_filename_component(arm64_sysroot ${CMAKE_CURRENT_LIST_DIR}/../build/arm64-sysroot ABSOLUTE)
set(CMAKE_SYSROOT ${arm64_sysroot})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_SYSROOT_DIR} ${arm64_sysroot})
set(ENV{PKG_CONFIG_LIBDIR}
  ${arm64_sysroot}/usr/lib/aarch64-linux-gnu/pkgconfig:${arm64_sysroot}/usr/share/pkgconfig)

# As CMake decides without cross compilation.
set(CMAKE_INSTALL_LIBDIR lib/aarch64-linux-gnu CACHE PATH "")

# Prints the manual pages (manuals.cmake); without it there are none.
find_program(QEMU_ARM64 NAMES qemu-aarch64-static qemu-aarch64)
if(QEMU_ARM64)
  set(CMAKE_CROSSCOMPILING_EMULATOR ${QEMU_ARM64} -L ${arm64_sysroot})
endif()

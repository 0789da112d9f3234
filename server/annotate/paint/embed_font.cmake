# DejaVu Sans of Debian's fonts-dejavu-core -> bytes inside the binary: annotate::font_bytes().
find_file(WINDSPLAT_FONT DejaVuSans.ttf
  PATHS /usr/share/fonts/truetype/dejavu /usr/share/fonts/TTF /usr/share/fonts/dejavu-sans-fonts
  NO_DEFAULT_PATH)
if(NOT WINDSPLAT_FONT)
  message(FATAL_ERROR
    "DejaVuSans.ttf was not found: say ./scripts/setup build, or set WINDSPLAT_FONT")
endif()
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${WINDSPLAT_FONT})
file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/generated/font.S @ONLY CONTENT
"// Written by embed_font.cmake.
    .section .rodata
    .balign 16
    .globl windsplat_font_begin
    .globl windsplat_font_end
windsplat_font_begin:
    .incbin \"@WINDSPLAT_FONT@\"
windsplat_font_end:
    .section .note.GNU-stack,\"\",%progbits
")
set_source_files_properties(${PROJECT_BINARY_DIR}/generated/font.S PROPERTIES
  OBJECT_DEPENDS ${WINDSPLAT_FONT})
target_sources(windsplat_annotate PRIVATE ${PROJECT_BINARY_DIR}/generated/font.S)

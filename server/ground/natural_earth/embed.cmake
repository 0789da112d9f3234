# Coastlines and borders (lines.bin, from scripts/ground_data) -> bytes inside the binary.
set(WINDSPLAT_LINES ${CMAKE_CURRENT_LIST_DIR}/lines.bin)
file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/generated/lines.S @ONLY CONTENT
"// Written by embed.cmake of server/ground/natural_earth.
    .section .rodata
    .balign 16
    .globl windsplat_lines_begin
    .globl windsplat_lines_end
windsplat_lines_begin:
    .incbin \"@WINDSPLAT_LINES@\"
windsplat_lines_end:
    .section .note.GNU-stack,\"\",%progbits
")
set_source_files_properties(${PROJECT_BINARY_DIR}/generated/lines.S PROPERTIES
  OBJECT_DEPENDS ${WINDSPLAT_LINES})
target_sources(windsplat_ground PRIVATE ${PROJECT_BINARY_DIR}/generated/lines.S)

# web/ -> files inside the binary: target windsplat_web defines api::web_assets() (gzipped), target
# windsplat_report_template study::report_template().
# Rebuilds only if a source of the pages changes; needs node (18 or later) and npm.
find_program(WINDSPLAT_NODE NAMES node nodejs)
if(NOT WINDSPLAT_NODE)
  message(FATAL_ERROR "The page needs node and npm to be built: say ./scripts/setup web")
endif()

file(GLOB_RECURSE web_sources CONFIGURE_DEPENDS
  ${CMAKE_CURRENT_LIST_DIR}/src/* ${CMAKE_CURRENT_LIST_DIR}/report/*
  ${CMAKE_CURRENT_LIST_DIR}/scripts/*.mjs
  ${PROJECT_SOURCE_DIR}/clients/js/src/*.ts)
# Made by the command itself.
list(FILTER web_sources EXCLUDE REGEX clients/js/src/generated/)
list(APPEND web_sources
  ${CMAKE_CURRENT_LIST_DIR}/index.html
  ${CMAKE_CURRENT_LIST_DIR}/package.json
  ${CMAKE_CURRENT_LIST_DIR}/package-lock.json
  ${CMAKE_CURRENT_LIST_DIR}/tsconfig.json
  ${PROJECT_SOURCE_DIR}/clients/js/package.json
  ${PROJECT_SOURCE_DIR}/clients/js/tsconfig.json
  ${PROJECT_SOURCE_DIR}/protocol/view.schema.json
  ${PROJECT_SOURCE_DIR}/protocol/messages.schema.json
  ${PROJECT_SOURCE_DIR}/protocol/study.schema.json)

set(web_out ${PROJECT_BINARY_DIR}/web)
add_custom_command(
  OUTPUT ${web_out}/web_assets.S ${web_out}/web_assets.cpp
    ${web_out}/report_template.S ${web_out}/report_template.cpp
  COMMAND ${WINDSPLAT_NODE} ${CMAKE_CURRENT_LIST_DIR}/scripts/embed.mjs ${web_out}
  DEPENDS ${web_sources}
  COMMENT "Building the pages"
  VERBATIM)

add_library(windsplat_web STATIC ${web_out}/web_assets.cpp ${web_out}/web_assets.S)
target_include_directories(windsplat_web PUBLIC ${PROJECT_SOURCE_DIR})
target_link_libraries(windsplat_api PUBLIC windsplat_web)

add_library(windsplat_report_template STATIC
  ${web_out}/report_template.cpp ${web_out}/report_template.S)
target_include_directories(windsplat_report_template PUBLIC ${PROJECT_SOURCE_DIR})
add_dependencies(windsplat_report_template windsplat_web)  # one run of the command creates both
target_link_libraries(windsplat_study PUBLIC windsplat_report_template)

# Writes manual pages and completions, printed by PROGRAM, into FOLDER: windsplat.1.gz,
# windsplat-COMMAND.1.gz and completions/SHELL.
cmake_minimum_required(VERSION 3.25)

function(windsplat_page name)
  execute_process(COMMAND ${PROGRAM} man ${ARGN} OUTPUT_FILE ${FOLDER}/${name}
    COMMAND_ERROR_IS_FATAL ANY)
  execute_process(COMMAND gzip -9nf ${FOLDER}/${name} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

file(REMOVE_RECURSE ${FOLDER})
file(MAKE_DIRECTORY ${FOLDER}/completions)
# The commands are those that the help lists, one a line and indented by two spaces.
execute_process(COMMAND ${PROGRAM} --help OUTPUT_VARIABLE help COMMAND_ERROR_IS_FATAL ANY)
string(REGEX REPLACE ".*\nSubcommands:\n" "\n" help "${help}")
string(REGEX MATCHALL "\n  [a-z]+" commands "${help}")
list(TRANSFORM commands REPLACE "\n  " "")
if("man" IN_LIST commands)
  windsplat_page(windsplat.1)
  foreach(command IN LISTS commands)
    windsplat_page(windsplat-${command}.1 ${command})
  endforeach()
endif()
if("completions" IN_LIST commands)
  foreach(shell bash zsh fish)
    execute_process(COMMAND ${PROGRAM} completions ${shell}
      OUTPUT_FILE ${FOLDER}/completions/${shell} COMMAND_ERROR_IS_FATAL ANY)
  endforeach()
endif()

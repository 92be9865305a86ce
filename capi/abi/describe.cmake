# describe_abi(ABIDW LIBRARY HEADERS OUT): the binary interface of a library as XML, without anything that names a machine.
function(describe_abi abidw library headers out)
  execute_process(COMMAND ${abidw} --headers-dir ${headers} --drop-private-types --drop-undefined-syms --no-comp-dir-path
                          --no-show-locs --no-corpus-path --no-elf-needed --exported-interfaces-only
                          --out-file ${out} ${library} COMMAND_ERROR_IS_FATAL ANY)
  file(READ ${out} text)
  string(REGEX REPLACE "path='[^']*/(capi/src/[^'/]*)'" "path='\\1'" text "${text}")
  file(WRITE ${out} "${text}")
endfunction()
if(CMAKE_SCRIPT_MODE_FILE STREQUAL CMAKE_CURRENT_LIST_FILE)
  describe_abi(${ABIDW} ${LIBRARY} ${HEADERS} ${OUT})
endif()

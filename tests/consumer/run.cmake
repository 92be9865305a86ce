# cmake -DBUILD=… -DSOURCE=… -DWORK=… -DCC=… -DCXX=… -DPHOTOS=… [-DPYTHON=… -DPYTHON_DIR=…] -P run.cmake:
# installs the build into a new prefix, moves it, and uses it from outside: CMake's package, pkg-config, Python, and the
# three example programs, which make a model of the rig's photographs.
function(step text)
  message(STATUS "${text}")
  execute_process(COMMAND ${ARGN} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK}/pictures)
step("install" ${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/first)
file(RENAME ${WORK}/first ${WORK}/prefix)  # an installed tree may be moved
file(GLOB_RECURSE pc ${WORK}/prefix/*/lumihull.pc)
cmake_path(GET pc PARENT_PATH pc_folder)

step("configure" ${CMAKE_COMMAND} -G Ninja -S ${CMAKE_CURRENT_LIST_DIR} -B ${WORK}/build -DCMAKE_PREFIX_PATH=${WORK}/prefix
  -DCMAKE_C_COMPILER=${CC} -DCMAKE_CXX_COMPILER=${CXX} -DEXAMPLES=${SOURCE}/examples)
step("build" ${CMAKE_COMMAND} --build ${WORK}/build -j 2)
step("C++ program" ${WORK}/build/consumer_cpp)
step("C program" ${WORK}/build/consumer_c)

set(ENV{PKG_CONFIG_PATH} ${pc_folder})
find_program(pkg_config pkg-config)
if(pkg_config)
  execute_process(COMMAND ${pkg_config} --cflags --libs lumihull OUTPUT_VARIABLE flags COMMAND_ERROR_IS_FATAL ANY)
  separate_arguments(flags UNIX_COMMAND "${flags}")
  step("pkg-config" ${CC} -o ${WORK}/by_pkg_config ${CMAKE_CURRENT_LIST_DIR}/main.c ${flags})
  execute_process(COMMAND ${pkg_config} --variable=libdir lumihull OUTPUT_VARIABLE libdir OUTPUT_STRIP_TRAILING_WHITESPACE)
  step("program by pkg-config" ${CMAKE_COMMAND} -E env LD_LIBRARY_PATH=${libdir} ${WORK}/by_pkg_config)
endif()

find_program(program lumihull PATHS ${WORK}/prefix/bin NO_DEFAULT_PATH REQUIRED)
step("import" ${program} import projections ${PHOTOS}/P.txt -o ${WORK}/capture)
step("run" ${program} run ${WORK}/capture --resolution 60)
foreach(example c cpp)
  execute_process(COMMAND ${WORK}/build/turntable_${example} ${WORK}/capture WORKING_DIRECTORY ${WORK}/pictures
    COMMAND_ERROR_IS_FATAL ANY)
  file(RENAME ${WORK}/pictures ${WORK}/pictures_${example})
  file(MAKE_DIRECTORY ${WORK}/pictures)
endforeach()
if(PYTHON)
  execute_process(COMMAND ${CMAKE_COMMAND} -E env PYTHONPATH=${WORK}/prefix/${PYTHON_DIR} PYTHONDONTWRITEBYTECODE=1
      ${PYTHON} ${SOURCE}/examples/python/turntable.py ${WORK}/capture
    WORKING_DIRECTORY ${WORK}/pictures COMMAND_ERROR_IS_FATAL ANY)
endif()

# All three make the same pictures.
file(GLOB c_pictures ${WORK}/pictures_c/turntable_*.png)
list(LENGTH c_pictures count)
if(NOT count EQUAL 8)
  message(FATAL_ERROR "expected 8 pictures of the C example, found ${count}")
endif()
if(PYTHON)
  foreach(picture ${c_pictures})
    cmake_path(GET picture FILENAME name)
    step("${name}" ${CMAKE_COMMAND} -E compare_files ${picture} ${WORK}/pictures/${name})
  endforeach()
endif()

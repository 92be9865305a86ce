# The Python package: bindings/python/lumihull with the module _lumihull.

# The distribution's interpreter is the one that NumPy and pybind11 come with; `python3` in PATH may be another.
if(NOT DEFINED Python_EXECUTABLE AND EXISTS /usr/bin/python3)
  set(Python_EXECUTABLE /usr/bin/python3)
endif()
find_package(Python 3.9 REQUIRED COMPONENTS Interpreter Development.Module)
set(PYBIND11_FINDPYTHON ON)
find_package(pybind11 REQUIRED)
set(LUMIHULL_PYTHON_DIR lib/python${Python_VERSION_MAJOR}.${Python_VERSION_MINOR}/site-packages CACHE STRING
    "Where the Python package goes, below the prefix")

# lumihull_python_module(FOLDER SOURCES file…): in the build tree the package stands in python/lumihull, so that
# PYTHONPATH=BUILD/python finds it.
function(lumihull_python_module folder)
  cmake_parse_arguments(arg "" "" "SOURCES" ${ARGN})
  list(TRANSFORM arg_SOURCES PREPEND ${folder}/src/)
  set(package ${CMAKE_BINARY_DIR}/python/lumihull)
  pybind11_add_module(lumihull_python MODULE NO_EXTRAS ${arg_SOURCES})
  target_compile_definitions(lumihull_python PRIVATE LUMIHULL_VERSION="${PROJECT_VERSION}")
  file(RELATIVE_PATH libraries /${LUMIHULL_PYTHON_DIR}/lumihull /${CMAKE_INSTALL_LIBDIR})
  set_target_properties(lumihull_python PROPERTIES OUTPUT_NAME _lumihull LIBRARY_OUTPUT_DIRECTORY ${package}
    INSTALL_RPATH "$ORIGIN/${libraries}")
  foreach(file __init__.py _lumihull.pyi py.typed)
    configure_file(${folder}/lumihull/${file} ${package}/${file} COPYONLY)
    install(FILES ${folder}/lumihull/${file} DESTINATION ${LUMIHULL_PYTHON_DIR}/lumihull)
  endforeach()
  install(TARGETS lumihull_python LIBRARY DESTINATION ${LUMIHULL_PYTHON_DIR}/lumihull)
endfunction()

# What all targets share: packages, compiler settings, and one function for a layer's library.
list(APPEND CMAKE_MODULE_PATH ${CMAKE_CURRENT_LIST_DIR})

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_C_STANDARD 99)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_CXX_VISIBILITY_PRESET hidden)
set(CMAKE_C_VISIBILITY_PRESET hidden)
set(CMAKE_VISIBILITY_INLINES_HIDDEN ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/lib)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()

find_program(LUMIHULL_CCACHE ccache)
if(LUMIHULL_CCACHE AND PROJECT_IS_TOP_LEVEL AND NOT LUMIHULL_PRECOMPILED)  # it passes such files by
  set(CMAKE_C_COMPILER_LAUNCHER ${LUMIHULL_CCACHE})
  set(CMAKE_CXX_COMPILER_LAUNCHER ${LUMIHULL_CCACHE})
endif()

find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(JPEG REQUIRED)
find_package(PNG REQUIRED)
find_package(PkgConfig REQUIRED)
pkg_check_modules(libdeflate REQUIRED IMPORTED_TARGET libdeflate)
find_package(OpenSSL REQUIRED COMPONENTS Crypto)
find_package(nlohmann_json REQUIRED)
find_package(embree 3 REQUIRED)

include(GNUInstallDirs)

# lumihull_precompile(TARGET): the target's files start from cmake/precompiled.h, which base parses for all of them.
function(lumihull_precompile target)
  if(NOT LUMIHULL_PRECOMPILED)
    return()
  endif()
  set_target_properties(${target} PROPERTIES DEFINE_SYMBOL "")  # GCC takes what was parsed only under the same macros
  if(target STREQUAL "lumihull_base")
    target_precompile_headers(${target} PRIVATE ${PROJECT_SOURCE_DIR}/cmake/precompiled.h)
  else()
    target_precompile_headers(${target} REUSE_FROM lumihull_base)
  endif()
endfunction()

add_library(lumihull_flags INTERFACE)
target_compile_options(lumihull_flags INTERFACE
  $<$<COMPILE_LANGUAGE:CXX>:-Wall -Wextra -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual>
  $<$<COMPILE_LANGUAGE:C>:-Wall -Wextra -pedantic>
  # One answer on every machine: no contraction of a * b + c behind our back.
  -ffp-contract=off)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  # False alarms for std::string's operator+ (GCC bug 105329).
  target_compile_options(lumihull_flags INTERFACE $<$<COMPILE_LANGUAGE:CXX>:-Wno-restrict>)
  # At -O3, false alarms for Eigen's packets of four beside vectors of three, and for its small matrices; with precompiled
  # headers for std::string, too; pages long.
  foreach(alarm array-bounds maybe-uninitialized stringop-overflow stringop-overread)
    target_compile_options(lumihull_flags INTERFACE $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CONFIG:Release>>:-Wno-${alarm}>)
  endforeach()
endif()
if(LUMIHULL_WERROR)
  target_compile_options(lumihull_flags INTERFACE -Werror)
endif()
if(LUMIHULL_ARCH)
  target_compile_options(lumihull_flags INTERFACE -march=${LUMIHULL_ARCH})
endif()
if(LUMIHULL_SANITIZE)
  target_compile_options(lumihull_flags INTERFACE -fsanitize=${LUMIHULL_SANITIZE} -fno-omit-frame-pointer)
  target_link_options(lumihull_flags INTERFACE -fsanitize=${LUMIHULL_SANITIZE})
  if(LUMIHULL_SANITIZE MATCHES "undefined")
    # A check at each pointer's use doubles the time to compile (36 to 16 s for a file full of Eigen); what it tells
    # ends in the address sanitizer as well.
    target_compile_options(lumihull_flags INTERFACE -fno-sanitize=null,alignment,vptr,object-size)
  endif()
  # The sanitizers' own code makes it warn of values that are set (GCC's manual on -fsanitize, seen in OpenMesh).
  target_compile_options(lumihull_flags INTERFACE $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CXX_COMPILER_ID:GNU>>:-Wno-maybe-uninitialized>)
endif()
if(LUMIHULL_FUZZ)
  target_compile_options(lumihull_flags INTERFACE -fsanitize=fuzzer-no-link)  # the libraries tell what they have run
endif()

# lumihull_library(NAME FOLDER SOURCES file…): the shared library liblumihull_NAME.so from FOLDER/src, headers in
# FOLDER/include, exported as lumihull::NAME.
function(lumihull_library name folder)
  cmake_parse_arguments(arg "" "" "SOURCES" ${ARGN})
  list(TRANSFORM arg_SOURCES PREPEND ${folder}/src/)
  add_library(lumihull_${name} SHARED ${arg_SOURCES})
  add_library(lumihull::${name} ALIAS lumihull_${name})
  file(GLOB headers CONFIGURE_DEPENDS ${folder}/include/lumihull/${name}/*.h)
  target_sources(lumihull_${name} PUBLIC FILE_SET HEADERS BASE_DIRS ${folder}/include FILES ${headers})
  target_include_directories(lumihull_${name}
    PRIVATE ${folder}/src ${PROJECT_SOURCE_DIR}/libcapture/base/internal)
  target_compile_features(lumihull_${name} PUBLIC cxx_std_20)
  target_link_libraries(lumihull_${name} PRIVATE $<BUILD_INTERFACE:lumihull_flags>)
  set_target_properties(lumihull_${name} PROPERTIES
    EXPORT_NAME ${name} VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}
    INSTALL_RPATH "$ORIGIN")
  lumihull_precompile(lumihull_${name})
  install(TARGETS lumihull_${name} EXPORT lumihull-targets
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} FILE_SET HEADERS)
endfunction()

# The C API's library, and the baseline that its binary interface is held against.

# lumihull_c_library(FOLDER SOURCES file…): liblumihull.so from FOLDER/src, headers FOLDER/include/*.h, exported as
# lumihull::capi. Only what FOLDER/lumihull.map lists leaves it.
function(lumihull_c_library folder)
  cmake_parse_arguments(arg "" "" "SOURCES" ${ARGN})
  list(TRANSFORM arg_SOURCES PREPEND ${folder}/src/)
  set(map ${CMAKE_CURRENT_SOURCE_DIR}/${folder}/lumihull.map)
  add_library(lumihull_capi SHARED ${arg_SOURCES})
  add_library(lumihull::capi ALIAS lumihull_capi)
  file(GLOB headers CONFIGURE_DEPENDS ${folder}/include/*.h)
  target_sources(lumihull_capi PUBLIC FILE_SET HEADERS BASE_DIRS ${folder}/include FILES ${headers})
  target_include_directories(lumihull_capi PRIVATE ${folder}/src ${PROJECT_SOURCE_DIR}/libcapture/base/internal)
  target_compile_features(lumihull_capi PRIVATE cxx_std_20)
  target_compile_definitions(lumihull_capi PRIVATE LUMIHULL_VERSION="${PROJECT_VERSION}")
  target_link_libraries(lumihull_capi PRIVATE $<BUILD_INTERFACE:lumihull_flags>)
  # abidw reads types from debug information: in full, whatever the preset says.
  target_compile_options(lumihull_capi PRIVATE $<$<NOT:$<CONFIG:Release>>:-g2>)
  target_link_options(lumihull_capi PRIVATE LINKER:--version-script=${map})
  if(NOT LUMIHULL_SANITIZE)
    target_link_options(lumihull_capi PRIVATE LINKER:--no-undefined)
  endif()
  set_target_properties(lumihull_capi PROPERTIES
    OUTPUT_NAME lumihull EXPORT_NAME capi VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}
    INSTALL_RPATH "$ORIGIN" LINK_DEPENDS ${map})
  install(TARGETS lumihull_capi EXPORT lumihull-targets LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} FILE_SET HEADERS)
endfunction()

# lumihull_abi_baseline(FOLDER): `ninja abi-baseline` writes FOLDER/abi/lumihull.abi anew: to be done, looked at and
# committed when the interface grows.
function(lumihull_abi_baseline folder)
  find_program(LUMIHULL_ABIDW abidw)
  if(LUMIHULL_ABIDW)
    add_custom_target(abi-baseline
      COMMAND ${CMAKE_COMMAND} -DABIDW=${LUMIHULL_ABIDW} -DLIBRARY=$<TARGET_FILE:lumihull_capi>
              -DHEADERS=${CMAKE_CURRENT_SOURCE_DIR}/${folder}/include
              -DOUT=${CMAKE_CURRENT_SOURCE_DIR}/${folder}/abi/lumihull.abi
              -P ${CMAKE_CURRENT_SOURCE_DIR}/${folder}/abi/describe.cmake
      DEPENDS lumihull_capi COMMENT "Writing ${folder}/abi/lumihull.abi" VERBATIM)
  endif()
endfunction()

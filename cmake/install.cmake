# What find_package(lumihull) and pkg-config read. Comes after all libraries.
include(CMakePackageConfigHelpers)

install(EXPORT lumihull-targets NAMESPACE lumihull:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/lumihull)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/lumihullConfig.cmake.in ${CMAKE_BINARY_DIR}/lumihullConfig.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/lumihull)
# Before 1.0 the C++ interface may change with each minor version.
write_basic_package_version_file(${CMAKE_BINARY_DIR}/lumihullConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/lumihullConfig.cmake ${CMAKE_BINARY_DIR}/lumihullConfigVersion.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/lumihull)
file(RELATIVE_PATH LUMIHULL_PC_TO_PREFIX /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
configure_file(${CMAKE_CURRENT_LIST_DIR}/lumihull.pc.in ${CMAKE_BINARY_DIR}/lumihull.pc @ONLY)
install(FILES ${CMAKE_BINARY_DIR}/lumihull.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)

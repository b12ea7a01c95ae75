# Installed users write find_package(porthos) or pkg-config porthos, and #include "mechanics/aba.h" as in the tree.
include(CMakePackageConfigHelpers)
set(config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/porthos)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/porthosConfig.cmake.in ${PROJECT_BINARY_DIR}/porthosConfig.cmake
  INSTALL_DESTINATION ${config_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/porthosConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(EXPORT porthosTargets NAMESPACE porthos:: DESTINATION ${config_dir})
install(FILES ${PROJECT_BINARY_DIR}/porthosConfig.cmake ${PROJECT_BINARY_DIR}/porthosConfigVersion.cmake
  ${CMAKE_CURRENT_LIST_DIR}/sundials.cmake DESTINATION ${config_dir})

set(PC_ERFA "")
if(PORTHOS_ERFA_FOUND)
  set(PC_ERFA " erfa")
endif()
# Static libraries in link order, users before used; header-only rooms have nothing to link.
set(PC_LIBS "")
set(users_first ${PORTHOS_ROOMS})
list(REVERSE users_first)
foreach(room IN LISTS users_first)
  get_target_property(type porthos_${room} TYPE)
  if(type STREQUAL STATIC_LIBRARY)
    string(APPEND PC_LIBS " -lporthos_${room}")
  endif()
endforeach()
list(JOIN PORTHOS_PUBLIC_FLAGS " " PC_FLAGS)
file(RELATIVE_PATH PC_PREFIX /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
configure_file(${CMAKE_CURRENT_LIST_DIR}/porthos.pc.in ${PROJECT_BINARY_DIR}/porthos.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/porthos.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)

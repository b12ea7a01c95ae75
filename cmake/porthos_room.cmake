# porthos_room(<room> [PUBLIC <library>...] [PRIVATE <library>...])
# Makes the static library porthos_<room>, alias porthos::<room>, from every .cpp below the room's folder.
# A new file needs no edit here. A room without any .cpp is a header-only library.
function(porthos_room room)
  cmake_parse_arguments(PARSE_ARGV 1 needs "" "" "PUBLIC;PRIVATE")
  set(target porthos_${room})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  if(sources)
    add_library(${target} STATIC ${sources})
    target_link_libraries(${target} PRIVATE ${needs_PRIVATE})
    set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
    set(scope PUBLIC)
  else()
    add_library(${target} INTERFACE)
    set(scope INTERFACE)
  endif()
  add_library(porthos::${room} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${room})
  target_link_libraries(${target} ${scope} ${needs_PUBLIC})
  target_compile_features(${target} ${scope} cxx_std_20)
  target_compile_options(${target} ${scope} ${PORTHOS_PUBLIC_FLAGS})
  target_include_directories(${target} ${scope}
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/porthos>)

  install(TARGETS ${target} EXPORT porthosTargets)
  install(DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/porthos
    FILES_MATCHING PATTERN "*.h" PATTERN "*-inl.h" EXCLUDE PATTERN detail EXCLUDE)
endfunction()

# "scene/build_info.h": what a result file says about the program that wrote it. Rewritten only when something changed.
execute_process(COMMAND git rev-parse HEAD WORKING_DIRECTORY ${PROJECT_SOURCE_DIR}
  OUTPUT_VARIABLE PORTHOS_GIT_HASH OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE no_commit)
if(no_commit)
  set(PORTHOS_GIT_HASH unknown)
endif()
# Each commit appends to this log: configure again then, so that the hash is never an old one.
execute_process(COMMAND git rev-parse --git-path logs/HEAD WORKING_DIRECTORY ${PROJECT_SOURCE_DIR}
  OUTPUT_VARIABLE git_log OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
cmake_path(ABSOLUTE_PATH git_log BASE_DIRECTORY ${PROJECT_SOURCE_DIR})
if(EXISTS ${git_log} AND NOT IS_DIRECTORY ${git_log})
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${git_log})
endif()

set(PORTHOS_COMPILER "${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION}")
string(TOUPPER "${CMAKE_BUILD_TYPE}" build_type)
list(JOIN PORTHOS_PUBLIC_FLAGS " " public_flags)
set(PORTHOS_FLAGS "${CMAKE_CXX_FLAGS} ${CMAKE_CXX_FLAGS_${build_type}} -std=c++20 -fno-math-errno ${public_flags}")
string(STRIP "${PORTHOS_FLAGS}" PORTHOS_FLAGS)

configure_file(${CMAKE_CURRENT_LIST_DIR}/build_info.h.in ${PROJECT_BINARY_DIR}/generated/scene/build_info.h @ONLY)
add_library(porthos_build_info INTERFACE)
target_include_directories(porthos_build_info INTERFACE ${PROJECT_BINARY_DIR}/generated)

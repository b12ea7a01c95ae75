# Options of the Python module, folder python/. Debian's interpreter by name: another python3 may come first in PATH, and the
# module must be built for the one that will import it.
# pybind11 by its header: its own CMake files look for an interpreter of their choice.
find_path(PORTHOS_PYBIND11_INCLUDE_DIR pybind11/pybind11.h)
mark_as_advanced(PORTHOS_PYBIND11_INCLUDE_DIR)
# AUTO is decided at every configuration: pybind11 may come between two.
set(PORTHOS_BUILD_PYTHON AUTO CACHE STRING "Build the Python module (pybind11, numpy): ON, OFF or AUTO, where pybind11 is found")
set_property(CACHE PORTHOS_BUILD_PYTHON PROPERTY STRINGS AUTO ON OFF)
set(interpreter "")
if(EXISTS /usr/bin/python3)
  set(interpreter /usr/bin/python3)
else()
  find_program(interpreter python3 NO_CACHE)
endif()
if(NOT PORTHOS_PYTHON_EXECUTABLE)   # an earlier configuration found none: there may be one now
  unset(PORTHOS_PYTHON_EXECUTABLE CACHE)
endif()
set(PORTHOS_PYTHON_EXECUTABLE "${interpreter}" CACHE FILEPATH "Python interpreter that the module is built for")
set(PORTHOS_PYTHON_DIR "lib/python3/dist-packages" CACHE STRING "Where the package is installed, below the prefix")
if(PORTHOS_BUILD_PYTHON STREQUAL AUTO)
  set(PORTHOS_BUILD_PYTHON OFF)
  if(PROJECT_IS_TOP_LEVEL AND PORTHOS_PYBIND11_INCLUDE_DIR)
    set(PORTHOS_BUILD_PYTHON ON)
  endif()
endif()
if(PORTHOS_BUILD_PYTHON AND NOT PORTHOS_PYBIND11_INCLUDE_DIR)
  message(FATAL_ERROR "PORTHOS_BUILD_PYTHON is on and pybind11 was not found: install pybind11-dev")
endif()

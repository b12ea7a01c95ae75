# What each room links is in its CMakeLists.txt; porthosConfig.cmake.in and porthos.pc.in repeat the list for installed use.
find_package(PkgConfig REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(fmt 9 REQUIRED)
find_package(tinyxml2 REQUIRED)
find_package(nlohmann_json 3.10 REQUIRED)
find_package(OpenSSL 3 REQUIRED COMPONENTS Crypto)   # SHA-256
# The reference solvers of `porthos compare`; without them it compares our own methods.
include(${CMAKE_CURRENT_LIST_DIR}/sundials.cmake)

# The serial flavour by name: libsundials-dev brings the OpenMPI one along, and plain "hdf5" would find that.
pkg_check_modules(PORTHOS_HDF5 REQUIRED IMPORTED_TARGET hdf5-serial)

# BSD-3; without it the mean ellipses of Sun and Moon remain.
pkg_check_modules(PORTHOS_ERFA IMPORTED_TARGET erfa)

# Formulas of outputs.
pkg_check_modules(PORTHOS_MUPARSER REQUIRED IMPORTED_TARGET muparser)

# toml++ header-only, so that an installed Porthos does not ask for its shared library.
find_path(PORTHOS_TOML_INCLUDE_DIR toml++/toml.h REQUIRED)
mark_as_advanced(PORTHOS_TOML_INCLUDE_DIR)
add_library(porthos_toml INTERFACE)
target_include_directories(porthos_toml SYSTEM INTERFACE ${PORTHOS_TOML_INCLUDE_DIR})
target_compile_definitions(porthos_toml INTERFACE TOML_HEADER_ONLY=1)

# Threads and random streams of ensembles. Random123 is header-only and stays out of public headers.
find_package(TBB REQUIRED)
find_path(PORTHOS_RANDOM123_INCLUDE_DIR Random123/philox.h REQUIRED)
mark_as_advanced(PORTHOS_RANDOM123_INCLUDE_DIR)
add_library(porthos_random123 INTERFACE)
target_include_directories(porthos_random123 SYSTEM INTERFACE ${PORTHOS_RANDOM123_INCLUDE_DIR})

# EPL, for the tests and a command without GSL, never in the libraries: a second solver of plans. By file and not by ipopt.pc, which
# names the Fortran libraries of MUMPS that a program need not link itself.
if(PORTHOS_IPOPT)
  find_path(PORTHOS_IPOPT_INCLUDE_DIR IpTNLP.hpp PATH_SUFFIXES coin coin-or)
  find_library(PORTHOS_IPOPT_LIBRARY ipopt)
  mark_as_advanced(PORTHOS_IPOPT_INCLUDE_DIR PORTHOS_IPOPT_LIBRARY)
  if(PORTHOS_IPOPT_INCLUDE_DIR AND PORTHOS_IPOPT_LIBRARY)
    add_library(Ipopt::Ipopt UNKNOWN IMPORTED)
    set_target_properties(Ipopt::Ipopt PROPERTIES IMPORTED_LOCATION ${PORTHOS_IPOPT_LIBRARY}
      INTERFACE_INCLUDE_DIRECTORIES ${PORTHOS_IPOPT_INCLUDE_DIR} INTERFACE_COMPILE_DEFINITIONS HAVE_CSTDDEF)   # asked for by 3.11
  endif()
endif()

# GPL-3, therefore never in the libraries: for the tests, and for the command where PORTHOS_GSL_RIVALS asks for it.
if((PORTHOS_GSL AND PORTHOS_BUILD_TESTS) OR PORTHOS_GSL_RIVALS)
  find_package(GSL QUIET)
endif()

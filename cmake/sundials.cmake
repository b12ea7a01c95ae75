# SUNDIALS::cvode, arkode, ida and nvecserial, for the build and for the installed porthosConfig.cmake; SUNDIALS_FOUND if all are there.
# Found by file: SUNDIALS' own config demands OpenMP, which these do not use and not every Clang has.
find_path(SUNDIALS_INCLUDE_DIR cvode/cvode.h)
mark_as_advanced(SUNDIALS_INCLUDE_DIR)
set(SUNDIALS_FOUND TRUE)
if(NOT SUNDIALS_INCLUDE_DIR)
  set(SUNDIALS_FOUND FALSE)
endif()
foreach(part cvode arkode ida nvecserial)
  find_library(SUNDIALS_${part}_LIBRARY sundials_${part})
  mark_as_advanced(SUNDIALS_${part}_LIBRARY)
  if(NOT SUNDIALS_${part}_LIBRARY)
    set(SUNDIALS_FOUND FALSE)
  elseif(NOT TARGET SUNDIALS::${part})
    add_library(SUNDIALS::${part} UNKNOWN IMPORTED)
    set_target_properties(SUNDIALS::${part} PROPERTIES
      IMPORTED_LOCATION ${SUNDIALS_${part}_LIBRARY} INTERFACE_INCLUDE_DIRECTORIES ${SUNDIALS_INCLUDE_DIR})
  endif()
endforeach()

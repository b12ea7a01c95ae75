# The page of a report without its data, report_template.html: bundled from web/ by node and npm where they are; else taken from
# PORTHOS_REPORT_TEMPLATE or an earlier installation. Without any of these everything else works, and `porthos report` says so.
set(PORTHOS_REPORT_TEMPLATE "" CACHE FILEPATH "A finished report_template.html, instead of bundling it with node and npm")
set(PORTHOS_REPORT_BUILT ${CMAKE_CURRENT_BINARY_DIR}/report_template.html)
set(PORTHOS_REPORT_INSTALLED ${CMAKE_INSTALL_FULL_DATADIR}/porthos/report_template.html)
configure_file(places.h.in ${PROJECT_BINARY_DIR}/generated/report/places.h @ONLY)
target_include_directories(porthos_report PRIVATE ${PROJECT_BINARY_DIR}/generated)

find_program(PORTHOS_NODE NAMES node nodejs)
find_program(PORTHOS_NPM npm)
mark_as_advanced(PORTHOS_NODE PORTHOS_NPM)
set(PORTHOS_REPORT_HAS_TESTS OFF)
if(PORTHOS_REPORT_TEMPLATE)
  if(NOT EXISTS ${PORTHOS_REPORT_TEMPLATE})
    message(FATAL_ERROR "PORTHOS_REPORT_TEMPLATE is ${PORTHOS_REPORT_TEMPLATE}, expected a file")
  endif()
  configure_file(${PORTHOS_REPORT_TEMPLATE} ${PORTHOS_REPORT_BUILT} COPYONLY)
  set(PORTHOS_REPORT_FROM "${PORTHOS_REPORT_TEMPLATE}")
elseif(PORTHOS_NODE AND PORTHOS_NPM)
  file(GLOB web CONFIGURE_DEPENDS web/*.json web/*.mjs web/src/*)
  set(stamp ${CMAKE_CURRENT_BINARY_DIR}/web.stamp)   # made even if npm cannot reach its packages: no build fails for a page
  add_custom_command(OUTPUT ${stamp} DEPENDS ${web} ${CMAKE_CURRENT_LIST_DIR}/bundle.cmake
    COMMAND ${CMAKE_COMMAND} -DNODE=${PORTHOS_NODE} -DNPM=${PORTHOS_NPM} -DWEB=${CMAKE_CURRENT_SOURCE_DIR}/web
      -DWORK=${CMAKE_CURRENT_BINARY_DIR}/web -DPAGE=${PORTHOS_REPORT_BUILT} -DSTAMP=${stamp} -P ${CMAKE_CURRENT_LIST_DIR}/bundle.cmake
    COMMENT "Bundling the page of the report" VERBATIM)
  add_custom_target(porthos_report_page ALL DEPENDS ${stamp})
  set(PORTHOS_REPORT_FROM "bundled by ${PORTHOS_NODE}")
elseif(EXISTS ${PORTHOS_REPORT_INSTALLED})
  set(PORTHOS_REPORT_FROM "${PORTHOS_REPORT_INSTALLED}")
else()
  set(PORTHOS_REPORT_FROM "none: node or npm is missing (Debian: nodejs, npm); porthos report will say so")
endif()
set(PORTHOS_REPORT_FROM "${PORTHOS_REPORT_FROM}" PARENT_SCOPE)
install(FILES ${PORTHOS_REPORT_BUILT} DESTINATION ${CMAKE_INSTALL_DATADIR}/porthos OPTIONAL)

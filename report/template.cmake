# The page of a report without its data, report_template.html: bundled from web/ by node and npm where they are, else the plain page
# from the same sources, without playback and zoom. PORTHOS_REPORT_TEMPLATE names a finished one instead.
set(PORTHOS_REPORT_TEMPLATE "" CACHE FILEPATH "A finished report_template.html, instead of bundling it with node and npm")
set(PORTHOS_REPORT_BUILT ${CMAKE_CURRENT_BINARY_DIR}/report_template.html)
set(PORTHOS_REPORT_INSTALLED ${CMAKE_INSTALL_FULL_DATADIR}/porthos/report_template.html)
configure_file(places.h.in ${PROJECT_BINARY_DIR}/generated/report/places.h @ONLY)
target_include_directories(porthos_report PRIVATE ${PROJECT_BINARY_DIR}/generated)

find_program(PORTHOS_NODE NAMES node nodejs)
find_program(PORTHOS_NPM npm)
mark_as_advanced(PORTHOS_NODE PORTHOS_NPM)
if(PORTHOS_REPORT_TEMPLATE)
  if(NOT EXISTS ${PORTHOS_REPORT_TEMPLATE})
    message(FATAL_ERROR "PORTHOS_REPORT_TEMPLATE is ${PORTHOS_REPORT_TEMPLATE}, expected a file")
  endif()
  configure_file(${PORTHOS_REPORT_TEMPLATE} ${PORTHOS_REPORT_BUILT} COPYONLY)
  set(PORTHOS_REPORT_FROM "${PORTHOS_REPORT_TEMPLATE}")
else()
  file(GLOB web CONFIGURE_DEPENDS web/*.json web/*.mjs web/src/* web/plain/*)
  set(page_command ${CMAKE_COMMAND} -DWEB=${CMAKE_CURRENT_SOURCE_DIR}/web -DPAGE=${PORTHOS_REPORT_BUILT})
  set(PORTHOS_REPORT_FROM "plain, without playback: node or npm is missing (Debian: nodejs, npm)")
  if(PORTHOS_NODE AND PORTHOS_NPM)
    list(APPEND page_command -DNODE=${PORTHOS_NODE} -DNPM=${PORTHOS_NPM} -DWORK=${CMAKE_CURRENT_BINARY_DIR}/web)
    set(PORTHOS_REPORT_FROM "bundled by ${PORTHOS_NODE}")
  endif()
  set(stamp ${CMAKE_CURRENT_BINARY_DIR}/web.stamp)   # made even if npm cannot reach its packages: no build fails for a page
  add_custom_command(OUTPUT ${stamp} DEPENDS ${web} ${CMAKE_CURRENT_LIST_DIR}/bundle.cmake ${CMAKE_CURRENT_LIST_DIR}/plain.cmake
    COMMAND ${page_command} -DSTAMP=${stamp} -P ${CMAKE_CURRENT_LIST_DIR}/bundle.cmake
    COMMENT "Making the page of the report" VERBATIM)
  add_custom_target(porthos_report_page ALL DEPENDS ${stamp})
endif()
set(PORTHOS_REPORT_FROM "${PORTHOS_REPORT_FROM}" PARENT_SCOPE)
install(FILES ${PORTHOS_REPORT_BUILT} DESTINATION ${CMAKE_INSTALL_DATADIR}/porthos COMPONENT command OPTIONAL)

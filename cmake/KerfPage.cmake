# kerf_page(TARGET DIST): puts the built page (DIST/index.html and what it needs) into TARGET, each file compressed.
# Without a built page TARGET gets an empty one, and `kerf view` says how to build it. No npm is run here.
function(kerf_page target dist)
  find_package(Python3 COMPONENTS Interpreter)
  if(Python3_FOUND AND EXISTS ${dist}/index.html)
    file(GLOB_RECURSE files CONFIGURE_DEPENDS ${dist}/*)
    set(out ${CMAKE_CURRENT_BINARY_DIR}/page)
    add_custom_command(OUTPUT ${out}/page.S ${out}/page.cpp
      COMMAND Python3::Interpreter ${PROJECT_SOURCE_DIR}/scripts/embed-page ${dist} ${out}
      DEPENDS ${files} ${PROJECT_SOURCE_DIR}/scripts/embed-page
      COMMENT "Putting the page into the program" VERBATIM)
    set_source_files_properties(${out}/page.S PROPERTIES OBJECT_DEPENDS ${out}/page.cpp)
    set_source_files_properties(${out}/page.cpp PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
    target_sources(${target} PRIVATE ${out}/page.S ${out}/page.cpp)
    message(STATUS "kerf view: page from ${dist}")
  else()
    target_sources(${target} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/no_page.cpp)
    message(STATUS "kerf view: no page (build it with npm ci && npm run build in apps/viewer)")
  endif()
endfunction()

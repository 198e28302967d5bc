# kerf_module(NAME DEPENDS ... [TESTS ...]): src/kerf/NAME/*.cpp become one object library, tests/NAME/*_test.cpp one
# test program linked against this module, the modules below it and those after TESTS only.
set(KERF_MODULES "")

function(kerf_module name)
  cmake_parse_arguments(ARG "" "" "DEPENDS;TESTS" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/kerf/${name}/*.cpp)
  if(NOT sources)
    set(sources ${PROJECT_SOURCE_DIR}/cmake/empty.cpp)
  endif()
  add_library(kerf_${name} OBJECT ${sources})
  target_include_directories(kerf_${name} PUBLIC ${PROJECT_SOURCE_DIR}/src)
  target_link_libraries(kerf_${name} PRIVATE kerf_flags Eigen3::Eigen TBB::tbb fmt::fmt
                        tomlplusplus::tomlplusplus nlohmann_json::nlohmann_json)
  set(KERF_MODULES ${KERF_MODULES} ${name} PARENT_SCOPE)

  file(GLOB tests CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/tests/${name}/*.cpp)
  if(KERF_TESTS_LIKE)
    kerf_keep_tests_like("${KERF_TESTS_LIKE}" tests)
  endif()
  if(KERF_BUILD_TESTS AND tests)
    add_executable(kerf_${name}_tests ${tests} ${PROJECT_SOURCE_DIR}/tests/support/source_dir.cpp)
    target_include_directories(kerf_${name}_tests PRIVATE ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR}/tests)
    foreach(module ${name} ${ARG_DEPENDS} ${ARG_TESTS})
      target_sources(kerf_${name}_tests PRIVATE $<TARGET_OBJECTS:kerf_${module}>)
    endforeach()
    target_link_libraries(kerf_${name}_tests PRIVATE kerf_flags Eigen3::Eigen TBB::tbb fmt::fmt
                          tomlplusplus::tomlplusplus nlohmann_json::nlohmann_json
                          GTest::gtest GTest::gmock GTest::gtest_main)
    kerf_unity(kerf_${name}_tests 8)
    gtest_discover_tests(kerf_${name}_tests TEST_PREFIX ${name}. DISCOVERY_TIMEOUT 60
                         PROPERTIES LABELS ${name})
  endif()
endfunction()

# Compiles the files of a target in lots of so many. The headers cost more than what stands in the files, and are then read once a lot.
# The files must not have two things of one name: each file of tests has a namespace of its own (scripts/check-layers looks).
function(kerf_unity target lot)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ${KERF_UNITY} UNITY_BUILD_BATCH_SIZE ${lot})
endfunction()

# Leaves out of a list of tests' files those with no test whose name matches; files without tests help others and stay.
function(kerf_keep_tests_like expression list_name)
  set(kept "")
  foreach(path ${${list_name}})
    file(STRINGS ${path} all REGEX "^(TEST|INSTANTIATE)")
    file(STRINGS ${path} some REGEX "^(TEST|INSTANTIATE).*(${expression})")
    if(some OR NOT all)
      list(APPEND kept ${path})
    endif()
  endforeach()
  set(${list_name} ${kept} PARENT_SCOPE)
endfunction()

# Two installable static libraries with a CMake package: kerf::kerf has all modules but the page's back end, which is kerf::engine.
function(kerf_library)
  include(CMakePackageConfigHelpers)
  set(objects "")
  set(modules ${KERF_MODULES})
  list(REMOVE_ITEM modules engine)
  foreach(module ${modules})
    list(APPEND objects $<TARGET_OBJECTS:kerf_${module}>)
  endforeach()
  add_library(kerf STATIC ${objects})
  add_library(kerf::kerf ALIAS kerf)
  target_include_directories(kerf PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src>
                             $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_compile_features(kerf PUBLIC cxx_std_20)
  target_link_libraries(kerf PUBLIC TBB::tbb PRIVATE fmt::fmt)
  if(KERF_SANITIZE)
    target_link_options(kerf PUBLIC -fsanitize=${KERF_SANITIZE})
  endif()
  add_library(kerf_page_engine STATIC $<TARGET_OBJECTS:kerf_engine>)
  add_library(kerf::engine ALIAS kerf_page_engine)
  set_target_properties(kerf_page_engine PROPERTIES EXPORT_NAME engine OUTPUT_NAME kerf_engine)
  target_link_libraries(kerf_page_engine PUBLIC kerf PRIVATE fmt::fmt)
  install(TARGETS kerf kerf_page_engine EXPORT kerfTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  file(STRINGS ${PROJECT_SOURCE_DIR}/src/kerf/public_headers headers REGEX "^[^#]")
  foreach(header ${headers})
    get_filename_component(folder kerf/${header} DIRECTORY)
    install(FILES ${PROJECT_SOURCE_DIR}/src/kerf/${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/${folder})
  endforeach()
  install(EXPORT kerfTargets NAMESPACE kerf:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/kerf)
  configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/kerfConfig.cmake.in
    ${PROJECT_BINARY_DIR}/kerfConfig.cmake INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/kerf)
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/kerfConfigVersion.cmake COMPATIBILITY SameMinorVersion)
  install(FILES ${PROJECT_BINARY_DIR}/kerfConfig.cmake ${PROJECT_BINARY_DIR}/kerfConfigVersion.cmake
          DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/kerf)
endfunction()

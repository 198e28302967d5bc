# The parts of other projects that are headers, found on the machine that compiles and used for another one: by links, as the folder that they
# lie in has that machine's own headers too.
set(headers ${PROJECT_BINARY_DIR}/headers)
file(MAKE_DIRECTORY ${headers})
foreach(one fmt toml++ nlohmann)
  find_path(KERF_HEADERS_${one} ${one} PATHS /usr/include /usr/local/include NO_DEFAULT_PATH NO_CMAKE_FIND_ROOT_PATH REQUIRED)
  file(CREATE_LINK ${KERF_HEADERS_${one}}/${one} ${headers}/${one} SYMBOLIC)
endforeach()
find_path(KERF_HEADERS_eigen Eigen/Core PATHS /usr/include/eigen3 /usr/local/include/eigen3 NO_DEFAULT_PATH NO_CMAKE_FIND_ROOT_PATH REQUIRED)

foreach(one Eigen3::Eigen TBB::tbb fmt::fmt tomlplusplus::tomlplusplus nlohmann_json::nlohmann_json)
  add_library(${one} INTERFACE IMPORTED)
endforeach()
target_include_directories(Eigen3::Eigen SYSTEM INTERFACE ${KERF_HEADERS_eigen})
foreach(one fmt::fmt tomlplusplus::tomlplusplus nlohmann_json::nlohmann_json)
  target_include_directories(${one} SYSTEM INTERFACE ${headers})
endforeach()
target_compile_definitions(fmt::fmt INTERFACE FMT_HEADER_ONLY=1)
target_compile_definitions(tomlplusplus::tomlplusplus INTERFACE TOML_HEADER_ONLY=1 TOML_EXCEPTIONS=0)

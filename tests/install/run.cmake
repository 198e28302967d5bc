# cmake -D BUILD= -D CONSUMER= -D WORK= -D COMPILER= -D GENERATOR= -P run.cmake
# Installs BUILD into a fresh folder, builds the consumer against that and runs it, and runs the installed program.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    string(JOIN " " command ${ARGN})
    message(FATAL_ERROR "${command}\nfailed (${status}):\n${output}")
  endif()
  message(STATUS "${output}")
endfunction()

# The consumer is the example of the README, word for word.
file(READ ${CONSUMER}/consumer.cpp consumer)
file(READ ${CONSUMER}/../../README.md readme)
string(FIND "${readme}" "${consumer}" place)
if(place EQUAL -1)
  message(FATAL_ERROR "the C++ example in README.md is not tests/install/consumer.cpp")
endif()

file(REMOVE_RECURSE ${WORK})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix)
if(EXISTS ${WORK}/prefix/include/kerf/cutting/blade_sweep.h)
  message(FATAL_ERROR "headers that are private are installed")
endif()
run(${CMAKE_COMMAND} -S ${CONSUMER} -B ${WORK}/build -G ${GENERATOR} -D CMAKE_PREFIX_PATH=${WORK}/prefix
    -D CMAKE_CXX_COMPILER=${COMPILER})
run(${CMAKE_COMMAND} --build ${WORK}/build)
run(${WORK}/build/consumer)
if(EXISTS ${WORK}/prefix/bin/kerf)
  # Without it the program would find those of the sources.
  if(NOT EXISTS ${WORK}/prefix/share/kerf/scenes/sheet.toml)
    message(FATAL_ERROR "the scenes are not below the prefix")
  endif()
  run(${WORK}/prefix/bin/kerf info sheet)
endif()

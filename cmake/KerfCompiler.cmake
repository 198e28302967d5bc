# Flags shared by every target: warnings, the instruction set, and same input, same bits.
add_library(kerf_flags INTERFACE)
target_compile_options(kerf_flags INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Wnon-virtual-dtor
  -ffp-contract=off)  # fused multiply-adds would give other bits on other machines

if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  if(KERF_NATIVE)
    target_compile_options(kerf_flags INTERFACE -march=native)
  else()
    target_compile_options(kerf_flags INTERFACE -march=x86-64-v3)
  endif()
endif()

if(KERF_SANITIZE)
  target_compile_options(kerf_flags INTERFACE -fsanitize=${KERF_SANITIZE} -fno-omit-frame-pointer
                         -fno-sanitize-recover=all)
  target_link_options(kerf_flags INTERFACE -fsanitize=${KERF_SANITIZE})
endif()

# For tests, after kerf_flags: their assertions are many calls of members, and a check of each pointer makes them compile twice as
# long. Addresses are checked all the same, and what the library does is checked in full.
add_library(kerf_test_flags INTERFACE)
if(KERF_SANITIZE MATCHES undefined)
  target_compile_options(kerf_test_flags INTERFACE -fno-sanitize=null,alignment,vptr,object-size)
endif()

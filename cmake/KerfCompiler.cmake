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
  if(KERF_SANITIZE MATCHES undefined)
    # A check of every pointer takes a third of the time to compile. What it would find, the address sanitizer finds where the pointer
    # is used; the readers, which take bytes for other things, have these checks in the fuzz targets.
    target_compile_options(kerf_flags INTERFACE -fno-sanitize=null,alignment,vptr,object-size)
  endif()
endif()

# A browser's worker: no threads, no files, and exceptions end the module. What is called there most is worth the bytes of -O3.
if(KERF_WASM)
  target_compile_options(kerf_flags INTERFACE -msimd128 -fignore-exceptions)
  target_compile_definitions(kerf_flags INTERFACE KERF_ONE_THREAD KERF_FILES_IN_MEMORY)
endif()

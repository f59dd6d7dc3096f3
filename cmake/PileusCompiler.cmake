# Compiler settings that every target of the project shares.
option(PILEUS_WERROR "Treat warnings as errors (on in CI)" OFF)
set(PILEUS_SANITIZE "" CACHE STRING "Sanitizers to build with: address, undefined, thread, or a ;-list")
set_property(CACHE PILEUS_SANITIZE PROPERTY STRINGS "" address undefined thread "address;undefined")

set(PILEUS_WITHOUT "" CACHE STRING
    "Effects to compile out, as a ;-list of SHADOWS, PHASE, ...: bench/effects counts what they cost where they are off")

find_program(PILEUS_CCACHE ccache)
if(PILEUS_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${PILEUS_CCACHE})
endif()

add_library(pileus_compiler INTERFACE)
target_compile_features(pileus_compiler INTERFACE cxx_std_20)
target_compile_options(pileus_compiler INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual -Wcast-qual
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>  # GCC 12 sees overlap in std::string where there is none (GCC bug 105651)
  $<$<BOOL:${PILEUS_WERROR}>:-Werror>
  -ffp-contract=off)  # a fused multiply-add appears only where std::fma is written
foreach(effect IN LISTS PILEUS_WITHOUT)
  target_compile_definitions(pileus_compiler INTERFACE PILEUS_WITHOUT_${effect})
endforeach()
foreach(sanitizer IN LISTS PILEUS_SANITIZE)
  target_compile_options(pileus_compiler INTERFACE -fsanitize=${sanitizer} -fno-omit-frame-pointer)
  target_link_options(pileus_compiler INTERFACE -fsanitize=${sanitizer})
endforeach()
if("undefined" IN_LIST PILEUS_SANITIZE)
  target_compile_options(pileus_compiler INTERFACE -fno-sanitize-recover=undefined)
endif()

# pileus_add_folder(NAME SOURCES... ) declares the object library of one top-level folder of the library;
# `pileus` (the shared library) is made of these objects.
function(pileus_add_folder name)
  add_library(pileus_${name} OBJECT ${ARGN})
  target_link_libraries(pileus_${name} PRIVATE pileus_compiler)
  target_include_directories(pileus_${name} PUBLIC ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR}/generated)
  set_target_properties(pileus_${name} PROPERTIES POSITION_INDEPENDENT_CODE ON)
endfunction()

# pileus_compile_as_kernels(FILE...) compiles files of SIMD loops in three versions: SSE4, AVX2 and AVX-512.
# Highway's portable one is broken in GCC 12.2 (GCC bug 106322).
function(pileus_compile_as_kernels)
  set_source_files_properties(${ARGN} PROPERTIES
                              COMPILE_OPTIONS "-msse4.2;-maes;-mpclmul"
                              COMPILE_DEFINITIONS "HWY_BASELINE_TARGETS=HWY_SSE4;HWY_DISABLED_TARGETS=HWY_SSSE3")
endfunction()

# One folder, one module, one target: darkbox_module(camera SOURCES ... PUBLIC ... PRIVATE ...) makes darkbox::camera.
# Without SOURCES the module is header-only.

add_library(darkbox_options INTERFACE)
target_include_directories(darkbox_options INTERFACE ${PROJECT_SOURCE_DIR})
target_compile_options(darkbox_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor
  -Wconversion -Wno-sign-conversion -Wno-float-conversion -ffp-contract=off
  $<$<BOOL:${DARKBOX_WARNINGS_AS_ERRORS}>:-Werror>)

find_program(CCACHE ccache)
if(CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
endif()

# Headers take more of a compiler's time than what most sources say themselves. darkbox_unity(darkbox_sim ALONE ...): but
# for these, such as kernels that compile themselves once per instruction set.
function(darkbox_unity target)
  cmake_parse_arguments(U "" "" "ALONE" ${ARGN})
  set_target_properties(${target} PROPERTIES UNITY_BUILD ${DARKBOX_UNITY} UNITY_BUILD_BATCH_SIZE 8)
  set_source_files_properties(${U_ALONE} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()

function(darkbox_module name)
  cmake_parse_arguments(M "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  if(M_SOURCES)
    add_library(darkbox_${name} STATIC ${M_SOURCES})
    target_link_libraries(darkbox_${name} PUBLIC ${M_PUBLIC} PRIVATE darkbox_options ${M_PRIVATE})
    target_include_directories(darkbox_${name} PUBLIC ${PROJECT_SOURCE_DIR})
  else()
    add_library(darkbox_${name} INTERFACE)
    target_link_libraries(darkbox_${name} INTERFACE ${M_PUBLIC})
    target_include_directories(darkbox_${name} INTERFACE ${PROJECT_SOURCE_DIR})
  endif()
  add_library(darkbox::${name} ALIAS darkbox_${name})
endfunction()

# darkbox_test(calibration_test SOURCES ... LINK ... WRAP ...): one test program, run by another where one is named; exit
# status 77 means every test skipped.
function(darkbox_test name)
  cmake_parse_arguments(T "" "" "SOURCES;LINK;WRAP" ${ARGN})
  add_executable(${name} ${T_SOURCES})
  target_link_libraries(${name} PRIVATE darkbox_options darkbox_test_main ${T_LINK})
  darkbox_unity(${name})
  # What is measured was built elsewhere. Values "never set" inside Eigen are a guess that -O3 makes better.
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1> -Wno-maybe-uninitialized)
  add_test(NAME ${name} COMMAND ${T_WRAP} $<TARGET_FILE:${name}>)
  set_tests_properties(${name} PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 600)
endfunction()

# darkbox_fuzzer(lampctl_fuzzer SOURCES ... LINK ...): one libFuzzer program, built by the preset "fuzz" alone.
function(darkbox_fuzzer name)
  if(NOT DARKBOX_FUZZERS)
    return()
  endif()
  cmake_parse_arguments(F "" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${F_SOURCES})
  target_link_libraries(${name} PRIVATE darkbox_options ${F_LINK})
  target_link_options(${name} PRIVATE -fsanitize=fuzzer)
  if(NOT TARGET fuzzers)
    add_custom_target(fuzzers)
  endif()
  add_dependencies(fuzzers ${name})
endfunction()

# SPDX-License-Identifier: BSD-3-Clause
# What every target of Riftmap shares. Nothing here reaches a consumer of the installed package.

function(riftmap_set_compile_options target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF)
  # No -march: one build runs anywhere, and Eigen's layout stays that of Debian's packages.
  # No contraction: the same bytes on machines with and without fused multiply-add.
  target_compile_options(
    ${target}
    PRIVATE -Wall
            -Wextra
            -Wpedantic
            -Wshadow
            -Wconversion
            -Wold-style-cast
            -Wnon-virtual-dtor
            -Woverloaded-virtual
            -Wsuggest-override
            -Wno-restrict # false alarms of g++ 12 on std::string operator+
            -ffp-contract=off
            $<$<BOOL:${RIFTMAP_WARNINGS_AS_ERRORS}>:-Werror>)
  if(RIFTMAP_SANITIZE)
    target_compile_options(${target} PRIVATE -fsanitize=${RIFTMAP_SANITIZE} -fno-omit-frame-pointer)
    target_link_options(${target} PRIVATE -fsanitize=${RIFTMAP_SANITIZE})
  endif()
endfunction()

# riftmap_add_library(NAME SOURCES a.cpp ... PUBLIC dep ... PRIVATE dep ...)
# Makes libriftmap-NAME.so, the alias riftmap::NAME, and its install rules.
function(riftmap_add_library name)
  cmake_parse_arguments(arg "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  set(target riftmap-${name})
  add_library(${target} SHARED ${arg_SOURCES})
  add_library(riftmap::${name} ALIAS ${target})
  riftmap_set_compile_options(${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name} VERSION ${PROJECT_VERSION}
                                             SOVERSION ${PROJECT_VERSION_MAJOR})
  target_include_directories(
    ${target} PUBLIC $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>
                     $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_link_libraries(${target} PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE})
  install(TARGETS ${target} EXPORT riftmap-targets)
  install(DIRECTORY include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
endfunction()

# riftmap_add_program(NAME) in apps/NAME: main.cpp over the class in libs/apps.
# The target is NAME-program where a library has taken the target NAME (riftmap-eval).
function(riftmap_add_program name)
  set(target ${name})
  if(TARGET ${name})
    set(target ${name}-program)
  endif()
  add_executable(${target} main.cpp)
  set_target_properties(${target} PROPERTIES OUTPUT_NAME ${name})
  riftmap_set_compile_options(${target})
  target_link_libraries(${target} PRIVATE riftmap::apps)
  install(TARGETS ${target})
endfunction()

# riftmap_add_tests(NAME LINK lib ... [LABELS l ...]): every *.cpp of the folder becomes one GoogleTest program.
function(riftmap_add_tests name)
  cmake_parse_arguments(arg "" "" "LINK;LABELS" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS *.cpp)
  add_executable(test-${name} ${sources})
  riftmap_set_compile_options(test-${name})
  target_include_directories(test-${name} PRIVATE ${PROJECT_SOURCE_DIR}/tests/common)
  target_compile_definitions(test-${name} PRIVATE RIFTMAP_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
                                                  RIFTMAP_BINARY_DIR="${PROJECT_BINARY_DIR}")
  target_link_libraries(test-${name} PRIVATE ${arg_LINK} GTest::gmock GTest::gtest_main)
  gtest_discover_tests(test-${name} TEST_PREFIX ${name}. DISCOVERY_MODE PRE_TEST
                       PROPERTIES TIMEOUT 600 LABELS "${arg_LABELS}")
endfunction()

# riftmap_add_benchmark(NAME LINK lib ...): every *.cpp of the folder becomes bench-NAME, which
# `./run bench NAME` starts as `bench-NAME --csv out/bench/NAME.csv` (header figure,value,unit).
function(riftmap_add_benchmark name)
  cmake_parse_arguments(arg "" "" "LINK" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS *.cpp)
  add_executable(bench-${name} ${sources})
  riftmap_set_compile_options(bench-${name})
  target_include_directories(bench-${name} PRIVATE ${PROJECT_SOURCE_DIR}/tests/common)
  target_compile_definitions(bench-${name} PRIVATE RIFTMAP_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
                                                   RIFTMAP_BINARY_DIR="${PROJECT_BINARY_DIR}")
  target_link_libraries(bench-${name} PRIVATE ${arg_LINK})
endfunction()

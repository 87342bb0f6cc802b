# How everything is compiled. Results are the same bits on every processor and with every one of these options.
option(YOUBOT_BASE_SIM_WERROR "Treat warnings as errors" OFF)

# Every operation rounds by itself: fused ones, which not all processors have, would round another way. g++ 12 fuses what
# it vectorizes like a product of complex numbers all the same, for processors that can.
add_compile_options(-ffp-contract=off -fno-tree-slp-vectorize)

# Four wheels fill one AVX2 register. The layout of types in headers is the same with it and without.
include(CheckCXXSourceRuns)
check_cxx_source_runs("int main() { return __builtin_cpu_supports(\"avx2\") ? 0 : 1; }" YOUBOT_BASE_SIM_HAS_AVX2)
option(YOUBOT_BASE_SIM_AVX2 "Build for processors with AVX2, as this one may be" ${YOUBOT_BASE_SIM_HAS_AVX2})
if(YOUBOT_BASE_SIM_AVX2)
  add_compile_options(-mavx2 -mtune=skylake-avx512)
endif()

# A shared library that programs link exports all functions of its namespace; else only what export.h marks, so that no
# flags of others replace a function in it.
if(NOT YOUBOT_BASE_SIM_SHARED)
  set(CMAKE_CXX_VISIBILITY_PRESET hidden)
endif()
set(CMAKE_VISIBILITY_INLINES_HIDDEN ON)

set(YOUBOT_BASE_SIM_TEST_TIMEOUT 1200)  # s, for tests that hang; one takes 400 beside four busy loops

# For scripts/sanitize and scripts/fuzz. Assertions of Eigen and the standard library are on, for they see what the
# sanitizers cannot: an index beyond its row, but within the matrix.
set(YOUBOT_BASE_SIM_SANITIZERS "" CACHE STRING "Sanitizers to build everything with, such as address,undefined or thread")
if(YOUBOT_BASE_SIM_SANITIZERS)
  string(REPLACE "-DNDEBUG" "" CMAKE_CXX_FLAGS_RELEASE "${CMAKE_CXX_FLAGS_RELEASE}")
  # Points-to analysis would take ten minutes for each file of methods.
  add_compile_options(-O2 $<$<CXX_COMPILER_ID:GNU>:-fno-tree-pta> -g1 -fno-omit-frame-pointer
    -fsanitize=${YOUBOT_BASE_SIM_SANITIZERS} -fno-sanitize-recover=all)
  add_compile_definitions(_GLIBCXX_ASSERTIONS YOUBOT_BASE_SIM_SANITIZERS)
  add_link_options(-fsanitize=${YOUBOT_BASE_SIM_SANITIZERS})
  set(YOUBOT_BASE_SIM_TEST_TIMEOUT 3600)
endif()

function(youbot_base_sim_warnings target)
  # g++ 12 takes reads of half-used AVX registers, in Eigen's expressions of three numbers, for overruns.
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wno-array-bounds
    $<$<BOOL:${YOUBOT_BASE_SIM_WERROR}>:-Werror>)
endfunction()

# Adds an archive of all .cpp files in a folder, linked to the libraries that follow.
function(youbot_base_sim_archive name folder)
  file(GLOB sources CONFIGURE_DEPENDS ${folder}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "/main\\.cpp$")
  add_library(${name} STATIC ${sources})
  target_link_libraries(${name} PUBLIC ${ARGN})
  youbot_base_sim_warnings(${name})
endfunction()

# Adds and installs a program of one file, linked to the libraries that follow.
function(youbot_base_sim_program name file)
  add_executable(${name} ${file})
  target_link_libraries(${name} PRIVATE ${ARGN} Boost::program_options)
  youbot_base_sim_warnings(${name})
  if(NOT YOUBOT_BASE_SIM_ROS)  # catkin has a place for programs
    set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR})
  endif()
  install(TARGETS ${name} RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
  set_property(GLOBAL APPEND PROPERTY youbot_base_sim_programs ${name})
endfunction()

# How tests are built. Each folder of tests begins with youbot_base_sim_test_folder(), ends with the timeout, and is one of
# those that youbot_base_sim_collect_tests() names.
find_package(GTest REQUIRED)
if(NOT TARGET GTest::gtest)  # CMake before 3.20 may know only the old names
  add_library(GTest::gtest INTERFACE IMPORTED GLOBAL)
  set_target_properties(GTest::gtest PROPERTIES INTERFACE_LINK_LIBRARIES GTest::GTest)
  add_library(GTest::gtest_main INTERFACE IMPORTED GLOBAL)
  set_target_properties(GTest::gtest_main PROPERTIES INTERFACE_LINK_LIBRARIES GTest::Main)
endif()

# Tests take longer to build than to run: -O0, or -O1 with sanitizers. gold links in a third of the time.
find_program(YOUBOT_BASE_SIM_GOLD ld.gold)
macro(youbot_base_sim_test_folder)
  # Precompiled headers of an object library serve programs only if both are compiled with the same options.
  unset(CMAKE_POSITION_INDEPENDENT_CODE)
  string(COMPARE NOTEQUAL "${YOUBOT_BASE_SIM_SANITIZERS}" "" youbot_base_sim_test_optimization)
  add_compile_options(-O${youbot_base_sim_test_optimization})
  if(YOUBOT_BASE_SIM_GOLD AND NOT YOUBOT_BASE_SIM_SANITIZERS)
    # gold does not find the libraries of libraries of Debian 11's Open MPI.
    add_link_options(-fuse-ld=gold LINKER:--allow-shlib-undefined)
  endif()
endmacro()

# A program of tests of what is free of ROS, linked to the libraries that follow; as a test, too. Compiling takes longer
# than running: only the library, the programs and those that are `optimized` (much of theirs is in headers) are optimized.
function(youbot_base_sim_test name file)
  cmake_parse_arguments(is "OPTIMIZED" "" "" ${ARGN})
  add_executable(${name} ${file})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/test)
  target_link_libraries(${name} PRIVATE youbot_base_sim_core fmt::fmt nlohmann_json::nlohmann_json GTest::gtest
    GTest::gtest_main ${is_UNPARSED_ARGUMENTS})
  target_compile_definitions(${name} PRIVATE YOUBOT_BASE_SIM_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
    SIMULATE="$<TARGET_FILE:simulate>" DESCRIBE_BASE="$<TARGET_FILE:describe_base>"
    $<$<BOOL:${YOUBOT_BASE_SIM_ROS}>:YOUBOT_BASE_SIM_ROS>)
  youbot_base_sim_warnings(${name})
  if(is_OPTIMIZED)
    target_compile_options(${name} PRIVATE -O1)
    target_precompile_headers(${name} REUSE_FROM optimized_test_headers)
  else()
    target_precompile_headers(${name} REUSE_FROM quick_test_headers)
  endif()
  add_test(NAME ${name} COMMAND ${name})
endfunction()

macro(youbot_base_sim_end_test_folder)
  get_property(all_tests DIRECTORY PROPERTY TESTS)
  set_tests_properties(${all_tests} PROPERTIES TIMEOUT ${YOUBOT_BASE_SIM_TEST_TIMEOUT})
endmacro()

# The target `tests` builds the programs of these folders, as catkin has it. What is not built then fails in ctest.
function(youbot_base_sim_collect_tests)
  if(NOT TARGET tests)
    add_custom_target(tests)
  endif()
  get_property(programs GLOBAL PROPERTY youbot_base_sim_programs)
  add_dependencies(tests ${programs} youbot_base_sim youbot_base_sim_meshes)
  foreach(folder ${ARGN})
    get_property(targets DIRECTORY ${folder} PROPERTY BUILDSYSTEM_TARGETS)
    foreach(target ${targets})
      get_target_property(type ${target} TYPE)
      if(type STREQUAL EXECUTABLE)
        add_dependencies(tests ${target})
      endif()
    endforeach()
  endforeach()
endfunction()

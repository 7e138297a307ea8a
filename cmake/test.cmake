# ft_test(LABEL NAME name COMMAND ...): as add_test, with one of the labels that tests/README.md explains.
# browser, linux and nightly are no part of a plain run: CMakePresets.json leaves them out.
set(FT_TEST_LABELS quick host emulated accuracy realtime browser linux nightly)

function(ft_test label)
  if(NOT label IN_LIST FT_TEST_LABELS)
    message(FATAL_ERROR "ft_test: \"${label}\" is no label of a test; choose one of: ${FT_TEST_LABELS}")
  endif()
  cmake_parse_arguments(arg "" "NAME" "COMMAND" ${ARGN})
  add_test(${ARGN})
  set_tests_properties(${arg_NAME} PROPERTIES LABELS ${label} ENVIRONMENT_MODIFICATION PYTHONDONTWRITEBYTECODE=set:1)
  # Python that loads shared objects under the sanitizers (host_tools/report/measure) needs their runtime before its own start.
  if(FINGERTIP_SANITIZE AND NOT FINGERTIP_LIBFUZZER AND label STREQUAL "accuracy" AND "Python3::Interpreter" IN_LIST arg_COMMAND)
    ft_loads_sanitized(${arg_NAME})
  endif()
  # Tests in real time run one at a time, from the beginning on: they wait while others compute. Each measures how late the machine was.
  if(label STREQUAL "realtime")
    set_tests_properties(${arg_NAME} PROPERTIES RESOURCE_LOCK real_time COST 80)
  elseif(label STREQUAL "nightly")
    set_tests_properties(${arg_NAME} PROPERTIES RESOURCE_LOCK nightly TIMEOUT 14400)
  endif()
  # What the quick tests need built: the programs that they name.
  if(label STREQUAL "quick")
    foreach(word IN LISTS arg_COMMAND)
      string(REGEX REPLACE "^\\$<TARGET_FILE:(.*)>$" "\\1" program "${word}")
      if(TARGET ${program})
        set_property(GLOBAL APPEND PROPERTY FT_QUICK_PROGRAMS ${program})
      endif()
    endforeach()
  endif()
endfunction()

function(ft_loads_sanitized)
  execute_process(COMMAND ${CMAKE_C_COMPILER} -print-file-name=libasan.so OUTPUT_VARIABLE runtime OUTPUT_STRIP_TRAILING_WHITESPACE)
  foreach(name IN LISTS ARGV)
    set_property(TEST ${name} APPEND PROPERTY ENVIRONMENT_MODIFICATION LD_PRELOAD=set:${runtime} ASAN_OPTIONS=set:detect_leaks=0)
  endforeach()
endfunction()

# After all tests: `cmake --build build/host --target quick_tests` builds what the quick ones run.
function(ft_quick_target)
  get_property(programs GLOBAL PROPERTY FT_QUICK_PROGRAMS)
  list(REMOVE_DUPLICATES programs)
  add_custom_target(quick_tests DEPENDS ${programs})
endfunction()

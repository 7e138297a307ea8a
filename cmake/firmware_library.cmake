# ft_library(NAME [SOURCES file...] [DEPENDS folder...])
#
# One static library ft_NAME for one folder of firmware/. Its headers are reachable as "NAME/x.h",
# and only by those who name it in DEPENDS: each folder gets an include directory of its own that
# holds nothing but a link to it. The dependency lists are the layering rule.
function(ft_library name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;DEPENDS")
  set(include_dir ${CMAKE_BINARY_DIR}/include/${name})
  file(MAKE_DIRECTORY ${include_dir})
  file(CREATE_LINK ${CMAKE_CURRENT_SOURCE_DIR}/${name} ${include_dir}/${name} SYMBOLIC)
  list(TRANSFORM arg_DEPENDS PREPEND ft_)
  if(arg_SOURCES)
    list(TRANSFORM arg_SOURCES PREPEND ${name}/ REGEX "^[^/]")
    add_library(ft_${name} STATIC ${arg_SOURCES})
    target_include_directories(ft_${name} PUBLIC ${include_dir})
    target_link_libraries(ft_${name} PUBLIC ${arg_DEPENDS} ft_codegen PRIVATE ft_warnings)
  else()
    add_library(ft_${name} INTERFACE)
    target_include_directories(ft_${name} INTERFACE ${include_dir})
    target_link_libraries(ft_${name} INTERFACE ${arg_DEPENDS} ft_codegen)
  endif()
endfunction()

# What the web page runs as WebAssembly, built from here into build/wasm exactly as `cmake --preset wasm`
# does, and the twin's tables for its simulated pad: all of it in build/host/host_tools/web/wasm, by the
# target web_wasm.
include_guard(GLOBAL)
include(ExternalProject)
include(wasm_missing)
wasm_missing(missing)
if(missing)
  message(FATAL_ERROR "${missing}")
endif()

set(wasm_dir ${CMAKE_SOURCE_DIR}/build/wasm)
set(FINGERTIP_WEB_WASM_DIR ${CMAKE_BINARY_DIR}/host_tools/web/wasm)
set(wasm_modules core simulated judges)
list(TRANSFORM wasm_modules REPLACE "(.+)" "${wasm_dir}/host_tools/web/wasm/\\1.wasm")
ExternalProject_Add(web_wasm_modules
  SOURCE_DIR ${CMAKE_SOURCE_DIR}
  BINARY_DIR ${wasm_dir}
  PREFIX ${CMAKE_BINARY_DIR}/web_wasm_modules
  CONFIGURE_COMMAND ${CMAKE_COMMAND} --preset wasm -S ${CMAKE_SOURCE_DIR} -DFINGERTIP_PAD=${FINGERTIP_PAD}
  BUILD_COMMAND ${CMAKE_COMMAND} --build ${wasm_dir}
  INSTALL_COMMAND ${CMAKE_COMMAND} -E make_directory ${FINGERTIP_WEB_WASM_DIR}
  COMMAND ${CMAKE_COMMAND} -E copy_if_different ${wasm_modules} ${FINGERTIP_WEB_WASM_DIR}
  BUILD_ALWAYS ON
  BUILD_BYPRODUCTS ${wasm_modules})
add_custom_command(OUTPUT ${FINGERTIP_WEB_WASM_DIR}/objects.bin
  COMMAND ${CMAKE_COMMAND} -E make_directory ${FINGERTIP_WEB_WASM_DIR}
  COMMAND web_tables ${FINGERTIP_WEB_WASM_DIR}/objects.bin ${CMAKE_BINARY_DIR}/contact_tables
  DEPENDS web_tables VERBATIM)
add_custom_target(web_wasm ALL DEPENDS ${FINGERTIP_WEB_WASM_DIR}/objects.bin)
add_dependencies(web_wasm web_wasm_modules)

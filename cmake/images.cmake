# The firmware images that the host tests and the demo run, built from here with the cross
# compiler into build/BOARD, exactly as `cmake --preset BOARD` does.
include(ExternalProject)

set(FINGERTIP_IMAGES pico_mux pico_parallel CACHE STRING "Boards whose image the tests run in the emulator; empty for none")

foreach(board IN LISTS FINGERTIP_IMAGES)
  set(image_dir ${CMAKE_SOURCE_DIR}/build/${board})
  ExternalProject_Add(image_${board}
    SOURCE_DIR ${CMAKE_SOURCE_DIR}
    BINARY_DIR ${image_dir}
    PREFIX ${CMAKE_BINARY_DIR}/image_${board}
    CONFIGURE_COMMAND ${CMAKE_COMMAND} --preset ${board} -S ${CMAKE_SOURCE_DIR}
    BUILD_COMMAND ${CMAKE_COMMAND} --build ${image_dir}
    INSTALL_COMMAND ""
    BUILD_ALWAYS ON
    BUILD_BYPRODUCTS ${image_dir}/fingertip-${board}.elf ${image_dir}/fingertip-${board}.bin
      ${image_dir}/fit_cycles.bin)
endforeach()

# The firmware images that the host tests and the demo run, built from here with the cross
# compiler into build/BOARD, of the scene that an image has if nothing else is asked for.
include(ExternalProject)

set(boards ${FINGERTIP_BOARDS})
list(REMOVE_ITEM boards native)
set(FINGERTIP_IMAGES ${boards} CACHE STRING "Boards whose image the tests run in the emulator; empty for none")

foreach(board IN LISTS FINGERTIP_IMAGES)
  # The programs that measure an image are for the tests and reports: a first demo need not wait for them.
  set(image_targets "")
  if(NOT BUILD_TESTING)
    set(image_targets --target fingertip-${board})
  endif()
  set(image_dir ${CMAKE_SOURCE_DIR}/build/${board})
  ExternalProject_Add(image_${board}
    SOURCE_DIR ${CMAKE_SOURCE_DIR}
    BINARY_DIR ${image_dir}
    PREFIX ${CMAKE_BINARY_DIR}/image_${board}
    CONFIGURE_COMMAND ${CMAKE_COMMAND} -G Ninja -S ${CMAKE_SOURCE_DIR} -B ${image_dir} -DCMAKE_BUILD_TYPE=Release
      -DCMAKE_TOOLCHAIN_FILE=${CMAKE_SOURCE_DIR}/cmake/toolchain-arm-none-eabi.cmake -DFINGERTIP_BOARD=${board}
      -DFINGERTIP_SCENE=${FINGERTIP_DEFAULT_SCENE}
    BUILD_COMMAND ${CMAKE_COMMAND} --build ${image_dir} ${image_targets}
    INSTALL_COMMAND ""
    BUILD_ALWAYS ON
    BUILD_BYPRODUCTS ${image_dir}/fingertip-${board}.elf ${image_dir}/fingertip-${board}.bin)
endforeach()
